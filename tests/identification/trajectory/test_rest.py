"""A body that bounces on a rigid stop until it rests, against exact parabolas."""

import dataclasses

import numpy as np
import pytest

from benchmarks.bouncing import GRAVITY, bounced, experiment
from identification.trajectory import fit as module
from identification.trajectory.fit import Fitted, fit
from identification.trajectory.motion import linearise, unrolled
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.variances import LARGEST_FORCE, SMALLEST_FORCE

RATE = 100.0
HEIGHTS = 0.08, 0.12


@pytest.fixture(scope="module")
def bouncing() -> tuple[Problem, float]:
    """Two records that end at rest, and the true restitution."""
    made, restitution = experiment(6, RATE)
    return problem_of(made), restitution


def test_one_trajectory_is_a_row_of_parabolas_that_ends_at_rest(bouncing):
    problem, restitution = bouncing
    start, chains = problem.start, problem.chains
    states, own = start.states.copy(), np.zeros_like(start.own)
    for knots, height in zip(chains.knots, HEIGHTS, strict=True):
        states[knots.start] = -height, 0.0
    at = dataclasses.replace(start, states=states, own=own, shared=np.full_like(start.shared, restitution))
    groups = tuple(dataclasses.replace(group, resting=np.zeros_like(group.resting)) for group in chains.groups)
    found, square = unrolled(problem.model_at(at), problem.unknowns, dataclasses.replace(chains, groups=groups), problem.integrator, at)
    assert np.isfinite(square)
    acceleration = GRAVITY * np.sin(problem.experiment.load.incline)
    for index, (knots, height) in enumerate(zip(chains.knots, HEIGHTS, strict=True)):
        times = np.concatenate([[0.0], np.cumsum(chains.duration[chains.of_record(index)])])
        expected = bounced(times, height, restitution, acceleration)
        assert np.allclose(found.states[knots, 0], expected, atol=1e-5)
        assert np.allclose(found.states[knots.stop - 1], 0.0, atol=1e-9)


def test_a_knot_beyond_the_stop_is_on_it(bouncing):
    problem, _ = bouncing
    states = problem.start.states.copy()
    states[0] = 1e-3, -0.1
    at = dataclasses.replace(problem.start, states=states, own=np.zeros_like(problem.start.own))
    on = dataclasses.replace(at, states=np.where(np.arange(len(states))[:, None] == 0, [0.0, -0.1], states))
    ends = [unrolled(problem.model_at(one), problem.unknowns, problem.chains, problem.integrator, one)[0].states[1] for one in (at, on)]
    assert np.allclose(*ends)


def test_restitution_and_no_random_force_come_out_of_bounces_that_end_at_rest(bouncing):
    problem, restitution = bouncing
    assert any(group.resting.any() for group in problem.chains.groups)
    found = fit(problem)
    assert found.converged
    assert found.variances.force.std < 10.0 * SMALLEST_FORCE * problem.scales.force
    assert found.variances.readings[0].std == pytest.approx(1.0, abs=0.1)
    assert abs(problem.values(found.at)["e"] - restitution) < 3.0 * found.stderr[0]


def test_where_no_beginning_of_a_record_can_be_followed_the_whole_is(bouncing, monkeypatch):
    problem, restitution = bouncing

    def lost(*args):
        raise np.linalg.LinAlgError

    monkeypatch.setattr(module, "_longer_and_longer", lost)
    found = fit(problem)
    assert found.converged
    assert abs(problem.values(found.at)["e"] - restitution) < 3.0 * found.stderr[0]


def test_of_two_ends_at_the_largest_random_force_the_likelier_one_counts(bouncing):
    problem, _ = bouncing
    found = fit(problem)
    largest = dataclasses.replace(found.variances.force, std=LARGEST_FORCE * problem.scales.force)

    def ended(deviance: float, force) -> Fitted:
        solution = dataclasses.replace(found.solution, deviance=deviance)
        return dataclasses.replace(found, solution=solution, variances=dataclasses.replace(found.variances, force=force))

    likely, unlikely, mode = ended(100.0, largest), ended(200.0, largest), ended(300.0, found.variances.force)
    ranked = sorted([unlikely, mode, likely], key=module._rank)
    assert [one is other for one, other in zip(ranked, (mode, likely, unlikely), strict=True)] == [True] * 3


def test_the_last_samples_read_the_place_of_the_stop(bouncing):
    """Where the body rests, a reading changes with the gap alone."""
    problem, _ = bouncing
    linear = linearise(problem.model, problem.unknowns, problem.chains, problem.integrator, problem.start, problem.scales.states)
    resting = np.concatenate([group.place[group.resting] for group in problem.chains.groups])
    by, gap = linear.by[resting, :, 0] / problem.chains.weight[resting], problem.unknowns.columns - len(problem.unknowns.own) + 2
    expected = np.zeros(problem.unknowns.columns)
    expected[gap] = 1.0
    assert np.allclose(by, expected, atol=1e-9)
