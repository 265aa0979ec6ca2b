"""The plain least-squares fit of collisions."""

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.recordings.independent_impacts import STOPS, Collision, fitted, simulated

MASS, SHARED = 0.15, np.array([np.log(6e3), 1.5, np.log(0.3), 0.1, np.log(4e3), np.log(9.0), np.log(0.05)])
TIME = np.arange(0.0, 0.15, 2e-3)


def test_the_motion_is_that_of_an_independent_integration():
    omega = 2.0 * np.pi * 9.0

    def rates(t, state):
        u, v, s, w = state
        depth, speed = u - s, v - w
        push = max(depth, 0.0) ** 1.5 * 6e3 * max(1.0 + 0.3 * speed, 0.0) * (1.0 + 0.1 * np.tanh(speed / 0.01))
        return v, -push / MASS, w, omega**2 * (push / 4e3 - s) - 2.0 * 0.05 * omega * w

    known = solve_ivp(rates, (0.0, TIME[-1]), (-0.01, 0.4, 0.0, 0.0), t_eval=TIME, rtol=1e-9, atol=1e-12, max_step=1e-3).y[0]
    np.testing.assert_allclose(simulated(TIME, MASS, SHARED, np.array([-0.01, 0.4, 0.0]), False, 20), known, atol=2e-7)


def test_a_support_that_gives_way_is_found():
    shared = np.where(np.arange(7) == 3, 0.0, SHARED)
    made = [simulated(TIME, MASS, shared, np.array([-0.01, speed, 0.0]), False, 20) for speed in (0.3, 0.8)]
    collisions = [Collision(file="made", time=TIME, u=u, gap=1e-3, mass=MASS) for u in made]
    (_, firm), (found, error) = (fitted(collisions, STOPS[stop]) for stop in ("firm", "on a spring"))
    assert error < 0.1 * firm
    np.testing.assert_allclose(found[4:6], SHARED[4:6], atol=0.1)  # of logarithms: a flat valley, in which the fit stops
