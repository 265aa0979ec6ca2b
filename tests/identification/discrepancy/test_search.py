"""How the search ends; what it names is in `test_diagnose.py`."""

import time

import numpy as np
import pytest

from identification.discrepancy import search as module
from identification.discrepancy.search import BUDGET, COMPLETE, MOST, search, share_added
from vibrojax.effects.free_form import FreeForm


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


def test_a_line_of_a_frequency_of_its_own_is_learned_before_a_mode_is_fitted(motion):
    """A mode that rings with a state of its own in every window would explain it too."""
    said = []
    found = search(motion.recorded(FreeForm(terms=("sine_1",), c1=0.2, f1_hz=11.3)), deadline=np.inf, progress=said.append)
    assert found.learned is not None and found.learned.effect.terms == ("sine_1",)
    assert found.learned.effect.f1_hz == pytest.approx(11.3, abs=0.01)
    assert (found.ended, found.steps, found.fitted.names) == (COMPLETE, (), ())
    assert not any("second_mode" in line for line in said)


@pytest.mark.parametrize(("model", "more", "share"), [(11.0, 1.0, 1.0), (2.0, 1.0, 0.1), (1.001, 1.0, 1e-4), (2.0, 12.0, 1.0)])
def test_share_of_the_misfit_that_more_than_a_model_explains(model, more, share):
    """The nominal model leaves 11."""
    assert share_added(11.0, model, more) == pytest.approx(share, rel=1e-6)


def test_a_further_effect_that_matters_little_is_not_added(rubbing, monkeypatch):
    monkeypatch.setattr(module, "RELEVANT", 1.1)
    found = search(rubbing, deadline=np.inf)
    assert (found.ended, found.steps) == (COMPLETE, ()) and found.refused[0].name == "coulomb_friction"
