"""Prediction of what is left out of a rig whose equations are linear, against whole matrices of the records that are left."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis import left_out as module
from identification.diagnosis.left_out import LeftOut, folds, left_out_density, left_out_fits
from identification.estimation.prediction import record_fits
from identification.trajectory.fit import Fitted, equations
from identification.trajectory.motion import Estimate
from identification.trajectory.random_force import RandomForce
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.variances import Variances
from tests.identification.trajectory.conftest import FORCE, MEMORY, RATE, shaken
from tests.identification.trajectory.dense import WHITE, dense

FORCES = [RandomForce(std=std * FORCE, memory=MEMORY) for std in (1.0, 0.4)]


@pytest.fixture(scope="module")
def whole() -> Problem:
    """Two decays; without the damping of steps, so that one goes the whole way."""
    problem = problem_of(shaken())
    return dataclasses.replace(problem, border=dataclasses.replace(problem.border, proximal=0.0))


def solved(problem: Problem, force: RandomForce) -> Fitted:
    """As if the first estimate were the mode."""
    variances = Variances(force=force, readings=(WHITE,))
    linear, local, solution = equations(problem, problem.start, variances)
    return Fitted(
        problem=problem, at=problem.start, variances=variances, linear=linear, local=local, solution=solution, rounds=1, converged=True
    )


def alone(problem: Problem, index: int) -> Problem:
    """One of its records about the same estimate, with the same scales."""
    experiment = dataclasses.replace(problem.experiment, records=problem.experiment.records[index : index + 1])
    one, border, knots = problem_of(experiment), problem.border, problem.chains.knots[index]
    own = {name: getattr(border, name)[index : index + 1] for name in ("own", "own_mean", "own_precision")}
    at = Estimate(
        states=problem.start.states[knots],
        force=problem.start.force[knots],
        shared=problem.start.shared,
        own=problem.start.own[index : index + 1],
    )
    return dataclasses.replace(one, border=dataclasses.replace(border, **own), scales=problem.scales, start=at, model=problem.model)


def test_the_density_is_that_of_all_records_over_that_of_the_others(whole):
    """Between two random forces, so that constants of the records fall out."""

    def directly(force: RandomForce) -> float:
        together = dense(whole, force, WHITE)[0]
        return sum(together - dense(alone(whole, other), force, WHITE)[0] for other in (1, 0))

    found = left_out_density(solved(whole, FORCES[0])) - left_out_density(solved(whole, FORCES[1]))
    assert found == pytest.approx(directly(FORCES[0]) - directly(FORCES[1]), abs=1e-2)


def test_a_record_is_predicted_by_the_frequency_of_the_others():
    """The second decays 2 % slower: its prediction swings as the first does, and misses it."""
    fast, slow = _decay(4.0), _decay(3.92)
    records = tuple(
        dataclasses.replace(record, channels={"hammer_displacement": values})
        for record, values in zip(shaken().records, (fast, slow), strict=True)
    )
    problem = problem_of(dataclasses.replace(shaken(), records=records))
    at = dataclasses.replace(problem.start, shared=np.log([0.02, 3.96]))
    problem = dataclasses.replace(problem, start=at, border=dataclasses.replace(problem.border, proximal=0.0))
    found = left_out_fits(solved(problem, RandomForce(std=1e-4 * FORCE, memory=MEMORY)))
    assert [one.file for one in found] == [record.file for record in records]
    assert [_frequency(one.predicted["hammer_displacement"]) for one in found] == pytest.approx([3.92, 4.0], rel=2e-3)
    assert min(one.nrmse["hammer_displacement"] for one in found) > 0.02


def test_of_one_record_the_later_half_is_left_out(whole):
    (later,) = folds(solved(alone(whole, 0), FORCES[0]))
    count = len(later)
    np.testing.assert_array_equal(later, np.arange(count) >= count // 2)
    assert np.isfinite(left_out_density(solved(alone(whole, 0), FORCES[0])))


def _decay(hz: float) -> np.ndarray:
    t, omega = np.arange(160) / RATE, 2.0 * np.pi * hz
    damped = omega * np.sqrt(1.0 - 0.02**2)
    return 5e-3 * np.exp(-0.02 * omega * t) * np.cos(damped * t) + 1e-6 * np.random.default_rng(2).standard_normal(160)


def _frequency(values: np.ndarray) -> float:
    """Natural frequency, Hz, of a free decay: the roots of the difference equation that it obeys."""
    coefficients, *_ = np.linalg.lstsq(np.stack([values[1:-1], values[:-2]], axis=1), values[2:], rcond=None)
    root = np.roots([1.0, *-coefficients])[0]
    return float(np.abs(np.log(root.astype(complex))) * RATE / (2.0 * np.pi))


@pytest.mark.parametrize(("force", "hits", "brief"), [(0.1, True, True), (0.1, False, False), (0.0, True, False)])
def test_models_are_compared_by_brief_errors_under_a_random_force_beside_impacts(whole, monkeypatch, force, hits, brief):
    monkeypatch.setattr(module, "strikes", lambda problem, at, index: hits)
    monkeypatch.setattr(module, "vanishes", lambda problem, one: one.std == 0.0)
    found = solved(whole, FORCES[0])
    shaken_so = dataclasses.replace(found.variances, force=RandomForce(std=force, memory=0.1))
    assert LeftOut(fitted=dataclasses.replace(found, variances=shaken_so), density=0.0).is_shaken == brief


def test_a_brief_error_is_that_of_brief_predictions(whole, monkeypatch):
    asked: list[bool] = []

    def predicted(fitted, chosen=None, *, brief=False):
        asked.append(brief)
        return record_fits(fitted, chosen)

    monkeypatch.setattr(module, "record_fits", predicted)
    found = LeftOut(fitted=solved(whole, FORCES[0]), density=0.0)
    held_back = dataclasses.replace(found, chain=found.fitted)
    assert module.errors_of(found, held_back, brief=True) == (found.brief_error, held_back.brief_error) and set(asked) == {True}
    asked.clear()
    assert module.errors_of(found, held_back, brief=False) == (found.error, held_back.error) and set(asked) == {False}
    assert LeftOut(fitted=found.fitted, density=np.inf).brief_error == 1.0


def test_records_are_predicted_when_the_error_is_asked_for(whole, monkeypatch):
    """A candidate that its density refuses takes no motion through them."""
    asked: list[Fitted] = []
    monkeypatch.setattr(module, "left_out_fits", lambda fitted: asked.append(fitted) or left_out_fits(fitted))
    found = module.left_out(solved(whole, FORCES[0]), whole.experiment)
    assert np.isfinite(found.density) and not asked
    assert found.error > 0.0 and len(asked) == 1
