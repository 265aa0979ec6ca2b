"""One-step errors against a textbook Kalman filter, and of a fit of a complete model."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.trajectory.fit import Fitted, equations, fit
from identification.trajectory.innovations import innovations, whiteness
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.variances import Variances
from tests.identification.trajectory.conftest import FORCE, MASS, MEMORY, NOISE, RATE, Linear
from vibrojax.integrate import Landing


def filtered(problem, force: RandomForce) -> np.ndarray:
    """Standardised innovations by segment: state u, u' and the force at both ends, matrices by the exponential; (segments, samples)."""
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
    found = []
    for index in range(len(chains.files)):
        mean, covariance = np.zeros(4), np.diag([*(scales.widest**2), force.std**2, force.std**2])
        covariance[2, 3] = covariance[3, 2] = kept * force.std**2
        segments = chains.of_record(index)
        # the prior of the initial motion is centred at the estimate, which is where a linearisation is taken
        mean[:2] = problem.start.states[chains.left[segments.start]]
        for segment in range(segments.start, segments.stop):
            spread = rows @ covariance @ rows.T + NOISE**2 * np.eye(chains.samples)
            off = chains.measured[segment, :, 0] - rows @ mean
            found.append(-np.linalg.solve(np.linalg.cholesky(spread), off))
            gain = covariance @ rows.T @ np.linalg.inv(spread)
            kept_part = np.eye(4) - gain @ rows
            mean = mean + gain @ off
            covariance = kept_part @ covariance @ kept_part.T + NOISE**2 * gain @ gain.T
            mean, covariance = onward @ mean, onward @ covariance @ onward.T + shake
    return np.array(found)


@pytest.mark.parametrize("force", [RandomForce(std=FORCE, memory=MEMORY), RandomForce(std=4.0 * FORCE, memory=0.01)])
def test_one_step_errors_are_those_of_a_kalman_filter(vibrating, force):
    border = dataclasses.replace(vibrating.border, shared=np.zeros(2, bool), own=np.zeros_like(vibrating.border.own))
    start = dataclasses.replace(vibrating.start, shared=np.log([0.02, 4.0]))
    problem = dataclasses.replace(vibrating, border=border, start=start, integrator=Landing(flight_step=jnp.asarray(2e-4)))
    variances = Variances(force=force, readings=(ReadingError(),))
    linear, local, solution = equations(problem, start, variances)
    held = Fitted(problem=problem, at=start, variances=variances, linear=linear, local=local, solution=solution, rounds=1, converged=True)
    assert np.allclose(innovations(held)[..., 0], filtered(problem, force), atol=1e-4)


def test_one_step_errors_of_a_complete_model_are_white(vibrating):
    found = whiteness(fit(vibrating))["hammer_displacement"]
    assert found.samples == 320
    assert found.variance == pytest.approx(1.0, abs=0.1)
    assert np.abs(found.correlations).max() < 3.5 / np.sqrt(found.samples)
