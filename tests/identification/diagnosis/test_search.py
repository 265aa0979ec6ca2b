"""How the search ends; what it names is in `test_diagnose.py`."""

import time

import numpy as np
import pytest

from identification.diagnosis import search as module
from identification.diagnosis.score.scored import Scored
from identification.diagnosis.search import BUDGET, COMPLETE, FAILED, MOST, Alternative, search
from identification.likelihood.fitted import Fitted
from identification.likelihood.random_effects import Variation
from identification.likelihood.variances import Variances
from identification.windows.prepare import Prepared
from tests.effects.scales import SCALES
from tests.identification.diagnosis import made_fit
from vibrojax.effects.free_form import FreeForm


@pytest.fixture(scope="module")
def rubbing(motion, friction):
    """A model that friction is missing from."""
    return motion.fitted(motion.shown(force=friction(0.05)))


def test_no_step_begins_after_the_deadline(rubbing):
    stages = []
    found = search(rubbing, deadline=time.monotonic() - 1.0, progress=stages.append)
    assert (found.ended, found.steps, found.refused) == (BUDGET, (), ())
    assert found.fitted is rubbing and found.first is found.last
    assert stages == ["scoring all candidates beside the nominal model"]


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


def test_a_further_effect_that_matters_little_is_not_added(rubbing, monkeypatch):
    monkeypatch.setattr(module, "RELEVANT", 1.1)
    found = search(rubbing, deadline=np.inf)
    assert (found.ended, found.steps) == (COMPLETE, ()) and found.refused[0].name == "coulomb_friction"


def test_a_significant_effect_whose_last_fit_fails_is_not_called_absent(rubbing, monkeypatch):
    monkeypatch.setattr(module, "_to_the_end", lambda found: None)
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
    monkeypatch.setattr(module, "_attempt", lambda prepared, *given, **options: recovered if prepared == "varied" else None)
    found = search(rubbing, deadline=np.inf, progress=said.append)
    assert said[1].startswith("fitting k_i that varies between records") == is_first
    assert found.fitted is recovered


def made(kind, **known):
    """An object of a class of which nothing but this is known."""
    return type(kind.__name__, (kind,), {"__init__": lambda self: None} | known)()


def alternative(name="coulomb_friction", *, gain=0.0, expected=0.0, **known):
    """One that was fitted, as much of it as the choice uses."""
    found = made(
        Fitted, **{"chi2_reduced": 5.0, "criterion": -gain, "to_go": 0.0, "title": name, "continued": name, "variances": None} | known
    )
    return Alternative(candidate=made_fit.candidate(name, expected), fitted=found, gain=gain)


@pytest.mark.parametrize(
    ("alternatives", "name", "expected", "hopeless"),
    [
        ([], "quadratic_drag", 1.0, False),
        ([alternative(gain=1000.0, expected=900.0)], "quadratic_drag", 50.0, True),
        ([alternative(gain=1000.0, expected=900.0)], "quadratic_drag", 150.0, False),
        ([alternative(gain=-1e5, expected=900.0)], "quadratic_drag", 1.0, False),
        ([alternative(gain=200.0, expected=900.0)], "quadratic_drag", 50.0, False),
        ([alternative(gain=1000.0, expected=900.0, chi2_reduced=1.01)], "quadratic_drag", 150.0, True),
        ([alternative(gain=1000.0, expected=900.0)], "deep_stop", 0.0, False),
        ([alternative(gain=1000.0, expected=900.0)], "back_stop", 0.0, False),
    ],
)
def test_what_is_worth_a_fit(monkeypatch, alternatives, name, expected, hopeless):
    """By what was gained, no matter what had been expected of it; what no derivative shows always is."""
    monkeypatch.setattr(module, "residual_share", lambda found, beside: (found.chi2_reduced - 1.0) / (beside.chi2_reduced - 1.0))
    scored = made(Scored, scales=SCALES, fitted=made(Fitted, chi2_reduced=10.0))
    assert module._is_hopeless(made_fit.candidate(name, expected), scored, alternatives, 900.0) is hopeless


def test_what_can_still_come_near_the_best_is_fitted_to_the_end(monkeypatch):
    """Their criteria with what another step would bring, against that of the best, 100 after its fit, and the model without, 180."""
    rough = [
        alternative("coulomb_friction", criterion=110.0, to_go=10.0),
        alternative("quadratic_drag", criterion=130.0, to_go=10.0),
        alternative("hysteresis", criterion=130.0, to_go=1.0),
        alternative("cubic_stiffness", criterion=300.0, to_go=100.0),
    ]
    ends = {"coulomb_friction": 100.0, "quadratic_drag": 105.0, "cubic_stiffness": None}

    def attempt(start, variances, *, rounds):
        if ends[start] is None:
            return None
        return made(Fitted, criterion=ends[start], log_likelihood=-0.5 * ends[start], converged=True, lightened=lambda self: self)

    monkeypatch.setattr(module, "_attempt", attempt)
    beside = made(Fitted, criterion=180.0, log_likelihood=-90.0)
    found = module._finished(rough, beside, lambda stage: None)
    assert [(one.name, one.fitted.criterion) for one in found] == [
        ("coulomb_friction", 100.0),
        ("quadratic_drag", 105.0),
        ("hysteresis", 130.0),
        ("cubic_stiffness", 300.0),
    ]
    assert [one.gain for one in found[:2]] == [80.0, 75.0]


@pytest.mark.parametrize(("criterion", "is_better"), [(90.0, True), (110.0, False), (None, False)])
def test_of_a_fit_that_has_not_converged_and_one_from_least_squares_the_better_is_kept(recovered, monkeypatch, criterion, is_better):
    """The latter starts where least squares end, without a random force."""
    began, other = [], None if criterion is None else made(Fitted, criterion=criterion)
    stuck = made(
        Fitted, title="back_stop", criterion=100.0, prepared=recovered.prepared, estimate=recovered.estimate, variances=recovered.variances
    )

    def attempt(prepared, variances, *, rounds):
        began.append(prepared.start)
        return other

    monkeypatch.setattr(module, "_attempt", attempt)
    assert module._by_least_squares(stuck, lambda stage: None) is (other if is_better else stuck)
    assert not np.any(began[0].force)
    np.testing.assert_allclose(began[0].shared, recovered.estimate.shared, atol=1e-3)


@pytest.mark.parametrize("error", [np.linalg.LinAlgError("singular"), module.NoConvergenceError("lost")])
def test_a_fit_that_fails_is_none(error, monkeypatch):
    def fails(*given, **more):
        raise error

    monkeypatch.setattr(module, "point", fails)
    assert module._attempt(made(Prepared, start=None), made(Variances), rounds=1) is None
