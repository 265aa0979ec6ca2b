"""Excitation from a record against SciPy's piecewise polynomials."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from vibrojax.excitation import CubicSignal, SampledForce, SampledMotion, Unforced

KNOTS = np.sort(np.random.default_rng(0).uniform(0.0, 2.0, 40))
SPLINE = CubicSpline(KNOTS, np.sin(7.0 * KNOTS))
SIGNAL = CubicSignal(knots=jnp.asarray(SPLINE.x), coefficients=jnp.asarray(SPLINE.c))
TIMES = np.concatenate([np.linspace(-0.1, 2.1, 500), KNOTS])  # beyond both ends, and on the knots


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_against_scipy(derivative):
    values = SIGNAL(jnp.asarray(TIMES), derivative)
    exact = SPLINE(TIMES, derivative)
    np.testing.assert_allclose(values, exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())


def test_derivatives_are_those_of_the_value():
    t = jnp.asarray(np.linspace(0.05, 1.9, 101))
    first = jax.vmap(jax.grad(SIGNAL))(t)
    np.testing.assert_allclose(first, SIGNAL(t, 1), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(jax.vmap(jax.grad(jax.grad(SIGNAL)))(t), SIGNAL(t, 2), rtol=1e-11, atol=1e-9)


def test_other_derivatives_are_refused():
    with pytest.raises(ValueError, match="derivative is 3; a cubic signal gives 0, 1 or 2"):
        SIGNAL(jnp.asarray(0.1), 3)


def test_plain_jit_vmap_and_lanes_agree():
    t = jnp.asarray([0.1, 0.7, 1.5])
    plain = SIGNAL(t)
    np.testing.assert_allclose(jnp.stack([SIGNAL(instant) for instant in t]), plain, rtol=1e-14)
    np.testing.assert_allclose(jax.jit(lambda signal, t: signal(t))(SIGNAL, t), plain, rtol=1e-12)
    lanes = CubicSignal(knots=jnp.stack([SIGNAL.knots] * 3), coefficients=jnp.stack([SIGNAL.coefficients] * 3))
    np.testing.assert_allclose(jax.vmap(lambda signal, t: signal(t))(lanes, t), plain, rtol=1e-14)


def test_motion_takes_position_and_acceleration_from_their_own_signals():
    twice = SPLINE.derivative(2)
    padded = np.concatenate([np.zeros((2, twice.c.shape[1])), twice.c])
    motion = SampledMotion(position=SIGNAL, second_derivative=CubicSignal(knots=jnp.asarray(twice.x), coefficients=jnp.asarray(padded)))
    t = jnp.asarray(np.linspace(0.05, 1.9, 50))
    np.testing.assert_allclose(motion.displacement(t), SPLINE(t), atol=1e-12)
    np.testing.assert_allclose(motion.velocity(t), SPLINE(t, 1), atol=1e-10)
    np.testing.assert_allclose(motion.acceleration(t), SPLINE(t, 2), atol=1e-9)


def test_forces():
    t = jnp.asarray([0.1, 0.7])
    np.testing.assert_array_equal(SampledForce(signal=SIGNAL).force(t), SIGNAL(t))
    np.testing.assert_array_equal(Unforced().force(t), 0.0)
