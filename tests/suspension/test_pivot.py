"""The arm on its bearing against the pendulum on wires, and past horizontal."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from vibrojax.suspension import Pendulum, Pivot

LENGTH, F_N, ZETA = 0.3, 1.2, 0.03
OMEGA = 2 * np.pi * F_N
NUMBERS = {"damping_ratio": ZETA, "natural_frequency_hz": F_N, "length": LENGTH}


@jax.jit
def compiled(suspension, u, v, drive):
    return suspension.acceleration(u, v, drive)


def swing(suspension, displacement: float, velocity: float, seconds: float, **options):
    def rates(t, y):
        u, v = (jnp.asarray(value) for value in y)
        return y[1], float(compiled(suspension, u, v, jnp.zeros_like(u)))

    return solve_ivp(rates, (0.0, seconds), (displacement, velocity), rtol=1e-9, atol=1e-12, **options)


def test_same_motion_as_the_pendulum_on_wires():
    """One motion in two coordinates, the arc and the horizontal displacement."""
    times, angle = np.linspace(0.0, 1.0, 21), 1.1
    arc = swing(Pivot(**NUMBERS), LENGTH * angle, 0.0, 1.0, t_eval=times).y[0]
    across = swing(Pendulum(**NUMBERS), LENGTH * np.sin(angle), 0.0, 1.0, t_eval=times).y[0]
    np.testing.assert_allclose(LENGTH * np.sin(arc / LENGTH), across, atol=1e-7)


@pytest.mark.parametrize("angle", [0.2, 2.6])
def test_period_of_a_swing_past_horizontal(angle):
    """T = 4 K(sin^2(phi / 2)) / omega_n, phi = 2.6 rad being 149 degrees."""
    undamped = Pivot(**(NUMBERS | {"damping_ratio": 0.0}))

    def through_the_bottom(t, y):
        return y[0]

    found = swing(undamped, LENGTH * angle, 0.0, 3.0, events=through_the_bottom).t_events[0]
    assert 2.0 * (found[1] - found[0]) == pytest.approx(4.0 * ellipk(np.sin(angle / 2) ** 2) / OMEGA, rel=1e-6)
