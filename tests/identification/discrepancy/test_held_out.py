"""Errors on windows that were left out of the fit."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy import held_out
from identification.likelihood import linearised
from identification.prepare import windows_of
from tests.identification.discrepancy import made_fit


def test_every_window_counts_once_however_many_are_integrated_side_by_side(motion, monkeypatch):
    """Five windows, left out two, one, one and one at a time; a motion that is off by 0.1 %."""
    prepared = windows_of(motion.prepared, np.arange(5))
    fitted = made_fit.fitted_to_nothing(motion.point, prepared)
    shifted = dataclasses.replace(fitted.estimate, shared=1.001 * fitted.estimate.shared)
    fitted = dataclasses.replace(fitted, point=dataclasses.replace(fitted.point, estimate=shifted))
    errors = []
    for side_by_side in (4, 1):
        monkeypatch.setattr(linearised, "CHUNK", side_by_side)
        errors.append(held_out.held_out(fitted))
    assert errors[0] == pytest.approx(errors[1], rel=1e-9)
    assert errors[0] > 0.0


def test_a_wrong_model_predicts_worse(recovered):
    """A spring that is held a twentieth too hard in frequency, which the initial states of windows cannot make up for."""
    layout, values = recovered.prepared.layout, recovered.prepared.layout.physical(recovered.estimate.shared)
    harder = dataclasses.replace(recovered.estimate, shared=layout.internal(values | {"f_n": 1.05 * values["f_n"]}))
    held = dataclasses.replace(recovered.prepared, fixed={"f_n": 1.05 * values["f_n"]})
    wrong = dataclasses.replace(recovered, point=dataclasses.replace(recovered.point, prepared=held, estimate=harder))
    assert held_out.held_out(wrong) > 2.0 * held_out.held_out(recovered) > 0.0


def test_of_a_single_window_nothing_can_be_left_out(motion):
    assert np.isnan(held_out.held_out(made_fit.fitted_to_nothing(motion.point, windows_of(motion.prepared, np.arange(1)))))
