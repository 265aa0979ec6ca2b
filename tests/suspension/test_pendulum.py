"""The pendulum in its horizontal displacement against the pendulum in its angle."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from vibrojax.suspension import Linear, Pendulum

LENGTH, F_N, ZETA = 0.09, 1.6, 0.04
OMEGA = 2 * np.pi * F_N
PENDULUM = Pendulum(damping_ratio=ZETA, natural_frequency_hz=F_N, length=LENGTH)


def drive(t):
    return 3.0 * np.sin(2 * np.pi * 2.3 * t + 0.4)


def integrate(slope, start, seconds, samples=200):
    times = np.linspace(0.0, seconds, samples)
    return times, solve_ivp(slope, (0.0, seconds), start, method="DOP853", rtol=1e-11, atol=1e-13, t_eval=times).y


@jax.jit
def compiled(suspension, u, v, drive):
    return suspension.acceleration(u, v, drive)


def relative_acceleration(suspension, u, v, drive):
    return np.asarray(compiled(suspension, *(jnp.asarray(value, dtype=float) for value in (u, v, drive))))


@pytest.mark.parametrize("angle", [0.05, 0.6, 1.1])
def test_same_motion_as_the_angle_equation(angle):
    def in_the_angle(t, y):
        phi, rate = y
        return rate, drive(t) * np.cos(phi) / LENGTH - 2 * ZETA * OMEGA * rate - OMEGA**2 * np.sin(phi)

    def in_the_displacement(t, y):
        return y[1], float(relative_acceleration(PENDULUM, y[0], y[1], drive(t)))

    _, (phi, rate) = integrate(in_the_angle, (angle, 0.5), 1.5)
    assert np.abs(phi).max() < 1.4
    _, (u, v) = integrate(in_the_displacement, (LENGTH * np.sin(angle), LENGTH * np.cos(angle) * 0.5), 1.5)
    np.testing.assert_allclose(u, LENGTH * np.sin(phi), atol=1e-9 * LENGTH)
    np.testing.assert_allclose(v, LENGTH * np.cos(phi) * rate, atol=1e-8 * LENGTH * OMEGA)


@pytest.mark.parametrize("angle", [0.3, 1.2])
def test_period_of_a_large_swing(angle):
    """T = 4 K(sin(angle / 2)) / omega, textbook."""
    undamped = Pendulum(damping_ratio=0.0, natural_frequency_hz=F_N, length=LENGTH)
    period = 4 * ellipk(np.sin(angle / 2) ** 2) / OMEGA
    start = (LENGTH * np.sin(angle), 0.0)
    _, (u, v) = integrate(lambda t, y: (y[1], float(relative_acceleration(undamped, y[0], y[1], 0.0))), start, period, samples=2)
    np.testing.assert_allclose((u[-1], v[-1] / OMEGA), start, atol=1e-9 * LENGTH)


def test_small_swings_are_linear_with_an_error_of_third_order():
    linear = Linear(damping_ratio=ZETA, natural_frequency_hz=F_N)
    sizes = np.array([4e-2, 2e-2, 1e-2]) * LENGTH
    errors = [
        abs(relative_acceleration(PENDULUM, size, size * OMEGA, 0.0) - relative_acceleration(linear, size, size * OMEGA, 0.0))
        for size in sizes
    ]
    np.testing.assert_allclose(np.diff(np.log(errors)) / np.diff(np.log(sizes)), 3.0, atol=0.01)


def test_stays_finite_where_the_wire_is_beyond_horizontal():
    assert np.all(np.isfinite(relative_acceleration(PENDULUM, np.array([1.0, 1.5, -2.0]) * LENGTH, np.full(3, 0.1), np.ones(3))))
