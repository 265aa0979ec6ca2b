"""Errors on windows that were left out of the fit."""

import numpy as np
import pytest

from identification.discrepancy import held_out
from identification.discrepancy.refit import windows_of
from tests.identification.discrepancy.made_search import settled


def test_every_window_counts_once_however_many_are_integrated_side_by_side(motion, monkeypatch):
    """Five windows fill one chunk of four and a part of another."""
    prepared = windows_of(motion.prepared, np.arange(5))
    fitted, local = settled(prepared, prepared.start, np.zeros(5)), prepared.start.local(prepared.record) * 1.001
    errors = []
    for side_by_side in (4, 1):
        monkeypatch.setattr(held_out, "CHUNK", side_by_side)
        errors.append(held_out._nrmse(fitted, local))
    assert errors[0] == pytest.approx(errors[1], rel=1e-9)
    assert errors[0] > 0.0
