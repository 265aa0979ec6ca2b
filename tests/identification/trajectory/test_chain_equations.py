"""The chain's equations against a Kalman filter and smoother, and against dense generalised least squares."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.trajectory import elimination
from identification.trajectory.chain_equations import residuals_after
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.remodel import remodelled
from identification.trajectory.start import Problem
from identification.trajectory.step import moved
from identification.trajectory.variances import reweighed, with_initial_size
from tests.identification.trajectory.conftest import FORCE, MASS, MEMORY, NOISE, RATE, Linear
from tests.identification.trajectory.dense import WHITE, dense, solved
from vibrojax.effects import SecondMode
from vibrojax.integrate import Landing

FORCES = [RandomForce(std=std * FORCE, memory=memory) for std, memory in ((1.0, MEMORY), (0.3, 3.0 * MEMORY), (4.0, 0.01))]


@pytest.fixture(scope="module")
def held(vibrating) -> Problem:
    """The problem with its true parameters, none of them free: what is left is linear. Fine steps: the filter's matrices are exact."""
    truth = np.log([0.02, 4.0])
    border = dataclasses.replace(vibrating.border, shared=np.zeros(2, bool), own=np.zeros_like(vibrating.border.own))
    start = dataclasses.replace(vibrating.start, shared=truth)
    return dataclasses.replace(vibrating, border=border, start=start, integrator=Landing(flight_step=jnp.asarray(2e-4)))


def filtered(problem: Problem, force: RandomForce) -> tuple[float, np.ndarray]:
    """-2 log likelihood and smoothed u, u', f at the knots: textbook Kalman filter and Rauch-Tung-Striebel smoother.

    State of a segment: u, u' and the force at both ends; matrices by the exponential, not by the program.
    """
    chains, scales = problem.chains, problem.scales
    duration = float(chains.duration[0])
    (kept,), (new,) = force.step(np.array([duration]))
    phi, by_first, by_last = Linear().passed(duration, duration)
    onward = np.zeros((4, 4))
    onward[:2] = np.column_stack([phi, by_first, by_last])
    onward[2, 3], onward[3, 3] = 1.0, kept
    shake = np.zeros((4, 4))
    shake[:2, :2] = force.bridge(np.array([duration]), MASS)[0] + np.diag(scales.floor**2)
    shake[3, 3] = new
    rows = np.array([np.column_stack(Linear().passed(k / RATE, duration))[0] for k in range(chains.samples)])
    deviance, smoothed = 0.0, []
    for index in range(len(problem.chains.files)):
        mean = np.zeros(4)
        covariance = np.diag([(10 * scales.displacement) ** 2, (10 * scales.velocity) ** 2, force.std**2, 0.0])
        covariance[2, 3] = covariance[3, 2] = kept * force.std**2
        covariance[3, 3] = force.std**2
        story = []
        for segment in range(chains.of_record(index).start, chains.of_record(index).stop):
            spread = rows @ covariance @ rows.T + NOISE**2 * np.eye(chains.samples)
            off = chains.measured[segment, :, 0] - rows @ mean
            gain = covariance @ rows.T @ np.linalg.inv(spread)
            deviance += off @ np.linalg.solve(spread, off) + np.linalg.slogdet(spread)[1]
            kept_part = np.eye(4) - gain @ rows  # Joseph's form, which rounding does not spoil
            mean = mean + gain @ off
            covariance = kept_part @ covariance @ kept_part.T + NOISE**2 * gain @ gain.T
            story.append((mean, covariance))
            mean, covariance = onward @ mean, onward @ covariance @ onward.T + shake
        later, back = story[-1][0], []
        for step, (mean, covariance) in enumerate(reversed(story)):
            if step:
                ahead = onward @ covariance @ onward.T + shake
                later = mean + covariance @ onward.T @ np.linalg.solve(ahead, later - onward @ mean)
            back.append(later[:3])
        smoothed += back[::-1]
    return deviance, np.array(smoothed)


def test_states_and_force_are_those_of_a_kalman_smoother(held):
    for force in FORCES:
        *_, solution = solved(held, force)
        at = moved(held, held.start, solution, 1.0)
        _, smoothed = filtered(held, force)
        found = np.column_stack([at.states, at.force])[held.chains.left]
        assert np.allclose(found, smoothed, rtol=0.0, atol=1e-4 * np.abs(smoothed).max(axis=0))


def test_likelihoods_compare_as_those_of_a_kalman_filter(held):
    local = solved(held, FORCES[0])[1]
    found = np.array([elimination.deviance(held, held.start, local, force) for force in FORCES])
    assert np.allclose(found, [elimination.solved(held, held.start, local, force).deviance for force in FORCES], rtol=1e-12)
    expected = np.array([filtered(held, force)[0] for force in FORCES])
    assert np.allclose(found - found[0], expected - expected[0], atol=1e-4)


@pytest.mark.parametrize("error", [WHITE, ReadingError(coefficients=(0.8, -0.3), innovation=0.8)])
def test_estimate_error_and_likelihood_are_those_of_generalised_least_squares(vibrating, error):
    one, other = FORCES[0], FORCES[1]
    *_, solution = solved(vibrating, one, error)
    likeliest, step, covariance = dense(vibrating, one, error)
    knots = vibrating.chains.knot_count
    assert np.allclose(solution.shared, step[3 * knots :], rtol=1e-5)
    assert np.allclose(solution.covariance, covariance[3 * knots :, 3 * knots :], rtol=1e-4)
    scale = np.abs(step[: 3 * knots].reshape(knots, 3)).max(axis=0)
    assert np.allclose(solution.knots, step[: 3 * knots].reshape(knots, 3), rtol=1e-4, atol=1e-5 * scale.max())
    between = solved(vibrating, other, error)[2].deviance - solution.deviance
    assert between == pytest.approx(dense(vibrating, other, error)[0] - likeliest, abs=1e-3)


def test_a_state_that_nothing_shows_adds_nothing_to_the_likelihood(vibrating):
    model = dataclasses.replace(vibrating.model, effects=(SecondMode(1e-12, 30.0, 0.05),))
    beside = remodelled(vibrating, vibrating.start, model)
    beside = dataclasses.replace(beside, border=dataclasses.replace(beside.border, shared=np.array([True, True, False, False, False])))
    assert solved(beside, FORCES[0])[2].deviance == pytest.approx(solved(vibrating, FORCES[0])[2].deviance, abs=1e-3)


@pytest.mark.parametrize("begin", [1.0, 1e2])
def test_states_at_the_beginning_become_likelier_by_expectation(vibrating, begin):
    model = dataclasses.replace(vibrating.model, effects=(SecondMode(0.1, 30.0, 0.05),))
    beside = remodelled(vibrating, vibrating.start, model)
    scales = dataclasses.replace(beside.scales, own_initial=begin * beside.scales.own)
    beside = dataclasses.replace(beside, scales=scales)
    _, local, before = solved(beside, FORCES[0])
    after = with_initial_size(beside, moved(beside, beside.start, before, 1.0), before)
    assert np.any(np.abs(after.scales.own_initial / scales.own_initial - 1.0) > 0.05)
    assert elimination.deviance(after, beside.start, local, FORCES[0]) < before.deviance


def test_a_step_within_limits_is_the_best_beside_what_is_held_there(vibrating):
    *_, solution = solved(vibrating, FORCES[0])
    _, step, covariance = dense(vibrating, FORCES[0], WHITE)
    knots, least, most = vibrating.chains.knot_count, np.full(2, -1e3), np.array([0.4 * solution.shared[0], 1e3])
    assert solution.shared[0] > 0, "else the limit is none"
    within, place = solution.within(least, most), 3 * knots
    expected = step + covariance[:, place] / covariance[place, place] * (most[0] - step[place])
    assert np.allclose(within.shared - solution.shared, expected[place:] - step[place:], rtol=1e-3)
    found = expected[:place].reshape(knots, 3)
    assert np.allclose(within.knots, found, rtol=1e-3, atol=1e-5 * np.abs(found).max())


def test_limits_that_are_not_reached_change_no_step(vibrating):
    *_, solution = solved(vibrating, FORCES[0])
    assert solution.within(np.full(2, -1e3), np.full(2, 1e3)) is solution


def test_draws_scatter_as_the_covariance_says(vibrating):
    *_, solution = solved(vibrating, FORCES[0])
    rng = np.random.default_rng(1)
    drawn = np.array([solution.draw(rng)[0] for _ in range(4000)])
    assert np.allclose(np.cov(drawn.T), solution.covariance, rtol=0.1, atol=0.05 * solution.covariance.max())
    _, _, dense_covariance = dense(vibrating, FORCES[0], WHITE)
    assert np.allclose(np.cov(drawn.T), dense_covariance[-2:, -2:], rtol=0.1, atol=0.05 * solution.covariance.max())


def test_residuals_after_a_step_are_linear_in_it(vibrating):
    linear, _, solution = solved(vibrating, FORCES[0])
    args = vibrating.chains, vibrating.border, linear
    whole = residuals_after(*args, solution.shared, solution.own, solution.knots)
    half = residuals_after(*args, 0.5 * solution.shared, 0.5 * solution.own, 0.5 * solution.knots)
    assert np.allclose(0.5 * (linear.residual + whole), half)
    assert np.sum(whole**2) < np.sum(linear.residual**2)


def test_a_segment_that_was_not_integrated_counts_nothing(vibrating):
    linear, _, _ = solved(vibrating, FORCES[0])
    done = linear.done.copy()
    done[10] = False
    broken = dataclasses.replace(linear, done=done, residual=np.where(done[:, None, None], linear.residual, 0.0))
    local = reweighed(vibrating, vibrating.start, broken, (WHITE,))
    assert not local.gram[10].any() and not local.defect[10].any()
    assert np.isfinite(elimination.solved(vibrating, vibrating.start, local, FORCES[0]).deviance)


@pytest.mark.parametrize("size", [1e3, 1e5, 1e6])
def test_columns_that_nearly_say_the_same_explain_no_more_than_there_is(size):
    """Least squares by the inverse of an information matrix whose small eigenvalues are rounding errors of its large ones."""
    rng = np.random.default_rng(2)
    one, other, rest = rng.standard_normal((3, 400))
    columns = np.stack([size * one, size * (one + 1e-6 * other), 0.01 * size * (one - other + 1e-6 * rest), 1e-3 * other], axis=1)
    residual = 2.0 * rng.standard_normal(400)
    explained = columns.T @ residual @ elimination._inverse(columns.T @ columns) @ columns.T @ residual
    assert 0.0 < explained < 0.05 * residual @ residual
