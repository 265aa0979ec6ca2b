"""A motion that a machine imposes: stiffness and damping from the force, by generalised least squares."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from statsmodels.tsa.arima_process import arma_acovf

from identification.experiment import Experiment, Record, Suspension
from identification.trajectory.course import Signal, by_sample, courses, responses
from identification.trajectory.fit import equations, fit
from identification.trajectory.innovations import whiteness
from identification.trajectory.motion import linearise
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.start import problem_of
from identification.trajectory.variances import SMALLEST_FORCE, Variances

MASS, ZETA, F_N = 2.0, 0.1, 3.0
RATE, SAMPLES, NOISE, POLE = 200.0, 600, 0.05, 0.8
"""Hz; of the record; N; of the force's reading error."""
OMEGA = 2.0 * np.pi * F_N


def moved(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """u, m, and u', m/s, of two tones."""
    w = 2.0 * np.pi * np.array([1.3, 2.9])
    return 4e-3 * np.sin(w[0] * time) + 2e-3 * np.sin(w[1] * time), 4e-3 * w[0] * np.cos(w[0] * time) + 2e-3 * w[1] * np.cos(w[1] * time)


@pytest.fixture(scope="module")
def led() -> Experiment:
    """One record, the force read with an autoregressive error."""
    time = np.arange(SAMPLES) / RATE
    u, v = moved(time)
    error = np.asarray(lfilter([1.0], [1.0, -POLE], NOISE * np.random.default_rng(3).standard_normal(SAMPLES + 200)))[200:]
    force = MASS * OMEGA**2 * u + 2.0 * ZETA * MASS * OMEGA * v + error
    record = Record(
        file="led.csv",
        kind="prescribed",
        gap=1.0,
        time=time,
        channels={"relative_displacement": u, "reaction_force": force},
        noise={"relative_displacement": 1e-12, "reaction_force": NOISE},
    )
    return Experiment(name="led", folder=Path(), mass=MASS, suspension=Suspension(kind="linear"), law="none", sha256="", records=(record,))


def test_a_prescribed_motion_is_generalised_least_squares(led):
    found = fit(problem_of(led))
    assert found.converged
    error = found.variances.readings[0]
    u, v = moved(led.records[0].time)
    lags = arma_acovf([1.0, *(-a for a in error.coefficients)], [1.0], SAMPLES, sigma2=error.innovation**2)[:SAMPLES]
    noise, design = NOISE**2 * toeplitz(lags), np.column_stack([u, v])
    information = design.T @ np.linalg.solve(noise, design)
    stiffness, damping = np.linalg.solve(information, design.T @ np.linalg.solve(noise, led.records[0].channels["reaction_force"]))
    omega = np.sqrt(stiffness / MASS)
    expected = np.log([damping / (2.0 * MASS * omega), omega / (2.0 * np.pi)])
    reached = found.at.shared + found.solution.shared * found.problem.border.shared_scale
    assert np.all(np.abs(reached - expected) < 0.02 * found.stderr)
    covariance = np.linalg.inv(information)
    by = np.array([[-0.5 / stiffness, 1.0 / damping], [0.5 / stiffness, 0.0]])
    assert np.allclose(found.stderr, np.sqrt(np.diag(by @ covariance @ by.T)), rtol=0.02)


def test_its_reading_error_is_found_and_leaves_white_errors(led):
    found = fit(problem_of(led))
    assert found.variances.readings[0].coefficients[0] == pytest.approx(POLE, abs=0.1)
    assert np.abs(np.array(found.at.shared) - np.log([ZETA, F_N])).max() < 3.0 * found.stderr.max()
    white = whiteness(found)["reaction_force"]
    assert white.variance == pytest.approx(1.0, abs=0.1)
    assert np.abs(white.correlations).max() < 3.5 / np.sqrt(SAMPLES)


def test_a_force_that_is_missing_is_seen_at_once(led):
    """By the sensor of the force, against it; over the noise."""
    fitted = fit(problem_of(led))
    chains = fitted.problem.chains
    _, sampled = courses(fitted)
    force = np.linspace(0.0, 3.0, len(chains.left))[:, None] * np.ones(chains.samples + 1)
    seen, end = responses(by_sample(fitted, sampled), chains, [Signal(force=force, stop=None, readings={})])
    counted = chains.weight[..., 0] > 0
    assert np.allclose(seen[..., 0, 0][counted], -force[:, :-1][counted] / NOISE) and not end.any()


def test_no_random_force_acts_on_a_prescribed_motion(led):
    problem = problem_of(led)
    pushed = dataclasses.replace(problem.start, force=np.ones_like(problem.start.force))
    ends = [
        linearise(problem.model, problem.unknowns, problem.chains, problem.integrator, at, problem.scales.states).residual
        for at in (problem.start, pushed)
    ]
    assert np.array_equal(*ends)


def test_its_knots_begin_on_the_motion(led):
    """Nothing is left between the segments at the first estimate, so that no defect enters the likelihood."""
    problem = problem_of(led)
    white = Variances(force=RandomForce(std=SMALLEST_FORCE * problem.scales.force, memory=0.1), readings=(ReadingError(),))
    _, local, _ = equations(problem, problem.start, white)
    assert np.abs(local.gap).max() < 1e-12 * np.abs(problem.start.states).max()
