"""How the search ends; what it names is in `test_diagnose.py`."""

import time

import numpy as np
import pytest

from identification.diagnosis.score.scored import score_all
from identification.diagnosis.search import alternatives
from identification.diagnosis.search import forward as module
from identification.diagnosis.search.forward import BUDGET, COMPLETE, FAILED, MOST, search
from identification.likelihood.random_effects import Variation
from vibrojax.effects.free_form import FreeForm


@pytest.fixture(scope="module")
def rubbing(motion, friction):
    """A model that friction is missing from."""
    return motion.fitted(motion.shown(force=friction(0.05)))


def test_no_step_begins_after_the_deadline(rubbing):
    said = []
    found = search(rubbing, deadline=time.monotonic() - 1.0, progress=said.append)
    assert (found.ended, found.steps, found.refused) == (BUDGET, (), ())
    assert found.fitted is rubbing and found.first is found.last
    assert said == ["scoring all candidates beside the nominal model"]


def test_no_step_begins_with_as_many_effects_as_are_fitted_together(rubbing, monkeypatch):
    monkeypatch.setattr(module, "MOST_EFFECTS", 0)
    assert search(rubbing, deadline=np.inf).ended == MOST


@pytest.mark.thorough
def test_nothing_is_added_to_a_complete_model(recovered):
    found = search(recovered, deadline=np.inf)
    assert (found.ended, found.steps) == (COMPLETE, ())
    assert found.fitted.names == ()


@pytest.mark.thorough
def test_a_line_of_a_frequency_of_its_own_is_learned_before_a_mode_is_fitted(motion):
    """A mode that rings with a state of its own in every window would explain it too."""
    said = []
    found = search(motion.recorded(FreeForm(terms=("sine_1",), c1=0.2, f1_hz=11.3)), deadline=np.inf, progress=said.append)
    assert found.learned is not None and found.learned.effect.terms == ("sine_1",)
    assert found.learned.effect.f1_hz == pytest.approx(11.3, abs=0.01)
    assert (found.ended, found.steps, found.fitted.names) == (COMPLETE, (), ())
    assert not any("second_mode" in line for line in said)


@pytest.fixture(scope="module")
def alternatives_of_rubbing(rubbing):
    """Two candidates beside it, fitted once."""
    return alternatives.fitted_in_full(score_all(rubbing, ("coulomb_friction", "quadratic_drag")), None, np.inf, lambda stage: None)


@pytest.mark.thorough
def test_a_further_effect_that_matters_little_is_not_added(rubbing, alternatives_of_rubbing, monkeypatch):
    monkeypatch.setattr(module, "fitted_in_full", lambda *given: alternatives_of_rubbing)
    monkeypatch.setattr(module, "RELEVANT", 1.1)
    found = search(rubbing, deadline=np.inf)
    assert (found.ended, found.steps) == (COMPLETE, ()) and found.refused[0].name == "coulomb_friction"


def test_a_step_that_the_deadline_cuts_is_not_the_end_of_a_search(rubbing, monkeypatch):
    monkeypatch.setattr(module, "fitted_in_full", lambda *given: ([], True))
    assert search(rubbing, deadline=np.inf).ended == BUDGET


def test_a_significant_effect_whose_last_fit_fails_is_not_called_absent(rubbing, alternatives_of_rubbing, monkeypatch):
    monkeypatch.setattr(module, "fitted_in_full", lambda *given: alternatives_of_rubbing)
    monkeypatch.setattr(module, "to_the_end", lambda found: None)
    found = search(rubbing, deadline=np.inf)
    assert (found.ended, found.steps) == (FAILED, ()) and found.refused[0].name == "coulomb_friction"


@pytest.mark.parametrize(("chi2", "is_first"), [(1e9, True), (1e-3, False)])
def test_a_variation_between_records_is_fitted_first_where_it_is_expected_to_gain_more_than_any_effect(
    rubbing, recovered, monkeypatch, chi2, is_first
):
    said = []
    varying = Variation(name="k_i", std=0.01, chi2=chi2, chance=1e-12)
    monkeypatch.setattr(module, "variations", lambda model: (varying,) if model is rubbing else ())
    monkeypatch.setattr(module, "with_variation", lambda model, one: "varied")
    monkeypatch.setattr(module, "attempt", lambda prepared, *given, **options: recovered if prepared == "varied" else None)
    monkeypatch.setattr(alternatives, "attempt", lambda *given, **options: None)
    found = search(rubbing, deadline=np.inf, progress=said.append)
    assert said[1].startswith("fitting k_i that varies between records") == is_first
    assert found.fitted is recovered
