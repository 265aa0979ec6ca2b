"""The plain least-squares fit of swinging arms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.recordings.independent import Swing, fitted, predicted, simulated

OMEGA, ZETA, FRICTION = 5.0, 0.01, 0.6


def made(angle: float, shared: np.ndarray) -> Swing:
    """A swing from rest without a motor."""
    time = np.arange(0.0, 4.0, 5e-3)
    swing = simulated(time, np.zeros(len(time)), shared, np.array([angle, 0.0]), 2e-3)
    return Swing(file="swing", time=time, angle=swing, moment=np.zeros(len(time)), every=2)


def test_the_motion_is_that_of_an_independent_integration():
    time = np.linspace(0.0, 3.0, 301)
    moment = 0.2 * np.sin(3.0 * time)
    shared = np.array([OMEGA, ZETA, 0.1, 4.0, 0.0, 0.05, 0.3])

    def rates(t, state):
        angle, rate = state
        drive = 4.0 * np.interp(t, time, moment) - 2.0 * ZETA * OMEGA * rate - OMEGA**2 * np.sin(angle - 0.1)
        return rate, drive - 0.05 * rate * abs(rate) - 0.3 * (angle - 0.1) ** 3

    known = solve_ivp(rates, (0.0, 3.0), (1.0, 0.0), t_eval=time, rtol=1e-9, atol=1e-10, max_step=0.01).y[0]
    np.testing.assert_allclose(simulated(time, moment, shared, np.array([1.0, 0.0]), 2e-3), known, atol=1e-5)


def test_friction_is_found_and_predicts_the_swing_left_out():
    shared = np.array([OMEGA, ZETA, 0.0, 1.0, FRICTION, 0.0, 0.0])
    swings = [made(angle, shared) for angle in (1.2, 0.9, 0.6)]
    values, error = fitted(swings, (0,), moved=False)
    assert values[4] == pytest.approx(FRICTION, rel=0.01)
    assert error < 1e-3
    assert predicted(swings, 2, (0,), moved=False) < 0.1 * predicted(swings, 2, (), moved=False)
