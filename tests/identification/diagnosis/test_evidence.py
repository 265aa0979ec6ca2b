"""What speaks for an effect, with predictions made to order."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis import diagnose
from identification.diagnosis import evidence as module
from identification.diagnosis.diagnosis import ADEQUATE, RESTLESS, UNDECIDED
from identification.diagnosis.evidence import NOT_CONVERGED, Judge, drives, strength
from identification.diagnosis.left_out import LeftOut
from identification.diagnosis.scores import Candidate, Scored, Scores
from identification.diagnosis.search import Alternative, Search
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.remodel import remodelled
from identification.trajectory.variances import SMALLEST_FORCE, Variances
from vibrojax.effects import AsymmetricDamping, CoulombFriction, PowerLawDamping, QuadraticDrag


@pytest.fixture
def predicted(scores, monkeypatch):
    """A judge to whom models predict with these densities and errors, in order; and what was worked out."""

    def made(*predictions: tuple[float, float], held_back: bool = True) -> tuple[Judge, list[Fitted]]:
        asked: list[Fitted] = []

        def left_out(fitted: Fitted, experiment) -> LeftOut:
            asked.append(fitted)
            density, error = predictions[len(asked) - 1]
            return Known(fitted=fitted, density=density, known=error)

        monkeypatch.setattr(module, "left_out", left_out)
        first, *rest = scores.fitted.problem.experiment.records
        experiment = dataclasses.replace(scores.fitted.problem.experiment, records=(dataclasses.replace(first, held_back=held_back), *rest))
        return Judge(experiment), asked

    return made


@dataclasses.dataclass(frozen=True, kw_only=True)
class Known(LeftOut):
    known: float

    @property
    def error(self) -> float:
        return self.known

    brief_error = error


def rubbing(scores: Scores, force: float) -> Fitted:
    """The model of `scores` with friction of this size, of which a hundredth of a newton is known."""
    one = scores.fitted
    model = dataclasses.replace(one.problem.model_at(one.at), effects=(CoulombFriction(force),))
    problem = remodelled(one.problem, one.at, model)
    size = len(problem.unknowns.shared)
    solution = dataclasses.replace(one.solution, covariance=(0.01 / problem.border.shared_scale) ** 2 * np.eye(size))
    return dataclasses.replace(one, problem=problem, at=problem.start, solution=solution)


def friction(scores: Scores, force: float = 0.2) -> Alternative:
    candidate = Candidate(name="coulomb_friction", members=(CoulombFriction(force),), signals=())
    return Alternative(candidate=candidate, gain=60.0, degrees=1, tried=100, fitted=rubbing(scores, force), drop=50.0)


def asked_of(judge: Judge, before: Fitted, one: Alternative) -> Alternative:
    """As a search does."""
    return judge(before, judge.with_held_back(before, one))


def test_records_held_back_count_and_each_model_predicts_once(scores, predicted):
    judge, asked = predicted((900.0, 0.3), (860.0, 0.1))
    one = asked_of(judge, scores.fitted, friction(scores))
    assert (one.held_back, one.best, one.fitted_gain, one.refused) == (40.0, 90.0, 50.0, "")
    assert len(asked) == 2


@pytest.mark.parametrize(("size", "refused"), [(0.29, True), (0.3, False)])
def test_beside_a_force_as_large_as_it_may_be_no_effect_is_refused_for_what_it_predicts(scores, predicted, size, refused):
    judge, _ = predicted((900.0, 0.1), (860.0, 0.3))
    one = friction(scores)
    force = RandomForce(std=size * one.fitted.problem.scales.force, memory=0.01)
    fitted = dataclasses.replace(one.fitted, variances=dataclasses.replace(one.fitted.variances, force=force))
    assert bool(judge(scores.fitted, dataclasses.replace(one, fitted=fitted)).refused) is refused


def test_a_fit_that_has_not_converged_is_not_taken_in_and_leaves_no_verdict(scores, predicted):
    judge, asked = predicted()
    one = friction(scores)
    refused = judge(scores.fitted, dataclasses.replace(one, fitted=dataclasses.replace(one.fitted, converged=False))).refused
    assert (refused, asked) == (NOT_CONVERGED, [])
    found = Search(nominal=scores.fitted, final=scores.fitted, steps=(), last=None, finished=True)
    assert diagnose._verdict(found, {"coulomb_friction": refused}, unexplained=False) == UNDECIDED


def test_without_such_records_the_gain_stays_and_those_left_out_in_turn_may_refuse(scores, predicted):
    judge, _ = predicted((900.0, 0.3), (910.0, 0.1), held_back=False)
    one = asked_of(judge, scores.fitted, friction(scores))
    assert (one.held_back, one.refused) == (0.0, "it does not predict better what was left out")


@pytest.mark.parametrize(("size", "passing", "refused"), [(0.3, True, False), (0.29, True, True), (0.3, False, True)])
def test_the_error_of_a_model_with_the_largest_force_is_no_limit_in_the_first_pass(scores, predicted, size, passing, refused):
    judge, _ = predicted((900.0, 0.1), (860.0, 0.3))
    force = RandomForce(std=size * scores.fitted.problem.scales.force, memory=0.01)
    before = dataclasses.replace(scores.fitted, variances=dataclasses.replace(scores.fitted.variances, force=force))
    one = judge(before, judge.with_held_back(before, friction(scores)), before if passing else None)
    assert (bool(one.refused), one.raises_error) == (refused, True)


@pytest.mark.parametrize(
    ("error", "allowing", "refused"), [(0.05, False, ""), (0.08, False, "rises with it"), (0.08, True, ""), (0.31, True, "rises with it")]
)
def test_an_effect_may_raise_the_error_of_the_free_motion_up_to_that_of_a_further_model(scores, predicted, error, allowing, refused):
    """Beside a power law in place of dry friction a true error of a sensor may raise it, until friction replaces the law."""
    judge, asked = predicted((900.0, 0.3), (860.0, 0.06), (700.0, error))
    first = friction(scores)
    assert not asked_of(judge, scores.fitted, first).refused
    second = judge(first.fitted, judge.with_held_back(first.fitted, friction(scores, 0.3)), scores.fitted if allowing else None)
    assert (refused in second.refused) if refused else second.refused == ""
    assert (second.errors, second.raises_error) == ((0.06, error), error > 0.06)
    assert (judge.errors(scores.fitted, first.fitted), len(asked)) == ((0.3, 0.06), 3)


@pytest.mark.parametrize(
    ("before", "after", "gain", "refused"),
    [
        ((np.inf, 1.0), (np.inf, 1.0), 0.0, "it does not predict better"),
        ((np.inf, 1.0), (860.0, 0.1), 1e6, ""),
        ((900.0, 0.3), (np.inf, 1.0), -1e6, "its gain of likelihood is no more than chance"),
        ((900.0, np.nan), (860.0, np.nan), 40.0, ""),
        ((900.0, 0.1), (860.0, 0.3), 40.0, "rises with it"),
    ],
    ids=["neither follows", "the nominal model does not follow", "it does not follow", "no signal", "larger error"],
)
def test_models_that_cannot_follow(scores, predicted, before, after, gain, refused):
    one = asked_of(predicted(before, after)[0], scores.fitted, friction(scores))
    assert one.held_back == gain
    assert (refused in one.refused) if refused else one.refused == ""


def test_numbers_that_a_record_has_of_its_own_are_paid_for(scores, predicted):
    judge, _ = predicted((900.0, 0.3), (860.0, 0.1))
    fitted = rubbing(scores, 0.2)
    own = fitted.problem.border.own_strengths.copy()
    own[:2] = True
    paid = dataclasses.replace(
        fitted, problem=dataclasses.replace(fitted.problem, border=dataclasses.replace(fitted.problem.border, own_strengths=own))
    )
    assert judge.held_back_gain(scores.fitted, paid) == 40.0 - 2.0 * 2


@pytest.mark.parametrize(("force", "expected"), [(0.2, 20.0), (0.02, 2.0)])
def test_a_strength_is_counted_in_its_errors(scores, force, expected):
    fitted = rubbing(scores, force)
    (effect,) = fitted.problem.model_at(fitted.at).effects
    assert strength(fitted, effect) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("after", "held_back", "converged", "gain", "refuting"),
    [
        ((860.0, 0.1), True, True, 240.0, 240.0),
        ((860.0, 0.4), True, True, 0.0, 0.0),
        ((910.0, 0.1), True, True, 0.0, 0.0),
        ((910.0, 0.4), False, True, 200.0, 200.0),
        ((910.0, 0.4), True, False, 0.0, 200.0),
    ],
    ids=["predicts better", "error rises", "density falls", "nothing held back", "no convergence"],
)
def test_a_free_form_counts_unless_it_fails_to_predict_what_was_held_back(
    scores, predicted, monkeypatch, after, held_back, converged, gain, refuting
):
    judge, _ = predicted((900.0, 0.3), after, held_back=held_back)
    rubs = rubbing(scores, 0.2)
    as_expected = dataclasses.replace(rubs.solution, deviance=scores.fitted.deviance - (200.0 if converged else 50.0))
    with_form = dataclasses.replace(rubs, converged=converged, solution=as_expected)
    for name, made in {"learned": (None, None), "at_first_order": scores, "continued": with_form}.items():
        monkeypatch.setattr(diagnose, name, lambda *args, made=made, **others: made)
    candidate, one = Candidate(name="any force over velocity", members=(), signals=(None,) * 16), scores.fitted
    scored = Scored(candidate=candidate, gain=300.0, strengths=np.zeros(16), known=np.ones(16, bool))
    weighed = Reestimated(deviance=0.0, strengths=np.zeros(16), covariance=np.eye(16), variances=one.variances, at=one.at)
    against, left, best = diagnose._with_prediction(((scored, weighed, 200.0),), 8, scores, one, judge, lambda line: None)
    assert (left[0][2], best is not None) == (gain, gain > 0.0)
    assert against[0][2] == refuting


def test_the_exponent_of_a_strength_is_held(scores):
    """A coefficient known to a factor of twenty with its exponent free, and to a tenth with it held."""
    one, effect = scores.fitted, PowerLawDamping(0.2, 1.5)
    problem = remodelled(one.problem, one.at, dataclasses.replace(one.problem.model_at(one.at), effects=(effect,)))
    (coefficient, exponent), scale = (
        [problem.unknowns.index(f"{effect.name}.{p.name}") for p in effect.parameters],
        problem.border.shared_scale,
    )
    errors, covariance = np.array([3.0, 0.5]), np.eye(len(scale))
    errors[0] *= 1.0 if problem.parameters[coefficient].logarithmic else 0.2
    correlation = np.sqrt(1.0 - (0.1 / 3.0) ** 2)
    found = errors[:, None] * np.array([[1.0, correlation], [correlation, 1.0]]) * errors
    covariance[np.ix_([coefficient, exponent], [coefficient, exponent])] = found / np.outer(*[scale[[coefficient, exponent]]] * 2)
    fitted = dataclasses.replace(one, problem=problem, at=problem.start, solution=dataclasses.replace(one.solution, covariance=covariance))
    assert strength(fitted, effect) == pytest.approx(10.0)


@pytest.mark.parametrize(("difference", "errors"), [(1.0, 0.0), (2.0, 0.0), (-4.0, 10.0)])
def test_a_passive_damper_drives_the_motion_in_neither_direction(scores, difference, errors):
    """Its mean is the suspension's damping, 2 zeta omega m, known to a tenth."""
    one, index = scores.fitted, scores.fitted.problem.unknowns.index("zeta")
    covariance = np.zeros_like(one.solution.covariance)
    covariance[index, index] = 0.1**2
    fitted = dataclasses.replace(one, solution=dataclasses.replace(one.solution, covariance=covariance))
    values = one.problem.values(one.at)
    damping = 4.0 * np.pi * values["zeta"] * values["f_n"] * one.problem.experiment.mass
    found = drives(fitted, AsymmetricDamping(difference * damping), size=1e6)
    assert found == pytest.approx(errors, rel=1e-3)
    assert drives(fitted, QuadraticDrag(1e3), size=1e6) == 0.0


@pytest.mark.parametrize(("innovation", "guessed", "verdict"), [(1.2, False, ADEQUATE), (2.0, False, RESTLESS), (2.0, True, ADEQUATE)])
def test_readings_that_are_off_by_more_than_the_noise_declared_are_not_adequate(scores, innovation, guessed, verdict):
    one = scores.fitted
    readings = tuple(ReadingError(innovation=innovation) for _ in one.variances.readings)
    none = RandomForce(std=SMALLEST_FORCE * one.problem.scales.force, memory=0.01)
    names = frozenset(one.problem.chains.channels if guessed else ())
    records = tuple(dataclasses.replace(record, noise_estimated=names) for record in one.problem.experiment.records)
    problem = dataclasses.replace(one.problem, experiment=dataclasses.replace(one.problem.experiment, records=records))
    fitted = dataclasses.replace(one, problem=problem, variances=Variances(force=none, readings=readings))
    found = Search(nominal=fitted, final=fitted, steps=(), last=None, finished=True)
    assert diagnose._verdict(found, {}, unexplained=False) == verdict
