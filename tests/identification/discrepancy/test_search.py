"""How the search ends; what it names is in `test_diagnose.py`."""

import time

import numpy as np
import pytest

from identification.discrepancy import search as module
from identification.discrepancy.search import BUDGET, COMPLETE, MOST, search


@pytest.fixture(scope="module")
def rubbing(motion, friction):
    """A model that friction is missing from."""
    return motion.fitted(motion.shown(force=friction(0.05)))


def test_no_step_begins_after_the_deadline(rubbing):
    told = []
    found = search(rubbing, deadline=time.monotonic() - 1.0, progress=told.append)
    assert (found.ended, found.steps, found.refused) == (BUDGET, (), ())
    assert found.fitted is rubbing and found.first is found.last
    assert told == ["scoring all candidates beside the nominal model"]


def test_no_step_begins_with_as_many_effects_as_are_fitted_together(rubbing, monkeypatch):
    monkeypatch.setattr(module, "MOST_EFFECTS", 0)
    assert search(rubbing, deadline=np.inf).ended == MOST


def test_nothing_is_added_to_a_complete_model(recovered):
    found = search(recovered, deadline=np.inf)
    assert (found.ended, found.steps) == (COMPLETE, ())
    assert found.fitted.names == ()
