"""Elementary functions: values against NumPy, derivatives where the textbook forms have none."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from vibrojax import smooth


def test_power_is_the_power():
    base = jnp.logspace(-12, 3, 200)
    for exponent in (0.3, 1.0, 1.5, 4.0):
        np.testing.assert_allclose(smooth.power(base, exponent), np.asarray(base) ** exponent, rtol=1e-13)


def test_log_is_the_logarithm_and_its_derivative_the_inverse():
    x = np.concatenate([np.logspace(-307, 308, 2001), 1.0 + np.linspace(-0.5, 0.5, 2001)])
    np.testing.assert_allclose(smooth.log(jnp.asarray(x)), np.log(x), rtol=4e-16, atol=5e-16)
    np.testing.assert_array_equal(smooth.log(jnp.asarray([np.inf, np.nan])), [np.inf, np.nan])
    np.testing.assert_allclose(jax.grad(smooth.log)(jnp.asarray(2e-4)), 1 / 2e-4, rtol=1e-15)
    np.testing.assert_allclose(smooth.log(jnp.asarray([1e-30, 0.7, 1e30], jnp.float32)), np.log([1e-30, 0.7, 1e30]), rtol=1e-6)


@pytest.mark.parametrize("base", [0.0, -1e-3])
@pytest.mark.parametrize("exponent", [0.3, 1.0, 1.5])
def test_power_and_its_derivatives_are_zero_at_and_below_zero(base, exponent):
    point = (jnp.asarray(base), jnp.asarray(exponent))
    assert smooth.power(*point) == 0.0
    for derivative in (jax.jacfwd, jax.jacrev):
        assert derivative(smooth.power, argnums=(0, 1))(*point) == (0.0, 0.0)
    assert all(float(second) == 0.0 for row in jax.hessian(smooth.power, argnums=(0, 1))(*point) for second in row)


def test_power_derivatives():
    base, exponent = jnp.asarray(2e-4), jnp.asarray(1.6)
    by_base, by_exponent = jax.grad(smooth.power, argnums=(0, 1))(base, exponent)
    np.testing.assert_allclose(by_base, 1.6 * 2e-4**0.6, rtol=1e-13)
    np.testing.assert_allclose(by_exponent, 2e-4**1.6 * np.log(2e-4), rtol=1e-13)


@pytest.mark.parametrize("width", [0.5, 2.0])
def test_step_and_ramp_switch_within_the_width(width):
    x = jnp.linspace(-2.0, 2.0, 401)
    below, above = x <= -0.5 * width, x >= 0.5 * width
    np.testing.assert_array_equal(smooth.step(x, width)[below], 0.0)
    np.testing.assert_allclose(smooth.step(x, width)[above], 1.0, rtol=1e-15)
    np.testing.assert_array_equal(smooth.ramp(x, width)[below], 0.0)
    np.testing.assert_array_equal(smooth.ramp(x, width)[above], x[above])
    assert bool(jnp.all(jnp.diff(smooth.step(x, width)) >= -1e-15))
    assert bool(jnp.all(smooth.ramp(x, width) >= jnp.maximum(x, 0.0) - 1e-15))
    np.testing.assert_allclose(smooth.step(x, width) + smooth.step(-x, width), 1.0, atol=1e-15)


@pytest.mark.parametrize("width", [0.3, 1.0])
def test_ramp_is_the_integral_of_step(width):
    x = jnp.linspace(-1.0, 1.0, 2001)
    np.testing.assert_allclose(jax.vmap(jax.grad(lambda x: smooth.ramp(x, width)))(x), smooth.step(x, width), atol=1e-13)


def test_step_is_twice_continuously_differentiable():
    first = jax.grad(lambda x: smooth.step(x, 1.0))
    for edge in (-0.5, 0.5):
        for derivative in (first, jax.grad(first)):
            beside = [derivative(jnp.asarray(edge + side)) for side in (-1e-9, 1e-9)]
            np.testing.assert_allclose(beside, 0.0, atol=1e-6)


def test_width_zero_is_the_sharp_switch():
    x = jnp.asarray([-1.0, -1e-300, 0.0, 1e-300, 1.0])
    np.testing.assert_array_equal(smooth.step(x, 0.0), [0.0, 0.0, 0.0, 1.0, 1.0])
    np.testing.assert_array_equal(smooth.ramp(x, 0.0), [0.0, 0.0, 0.0, 1e-300, 1.0])


@pytest.mark.parametrize("width", [0.0, 1e-12, 1.0])
@pytest.mark.parametrize("function", [smooth.step, smooth.ramp])
def test_derivatives_of_the_switch_are_finite(function, width):
    x = jnp.asarray([-1.0, -0.5, 0.0, 0.5, 1.0])
    for derivative in (jax.jacfwd, jax.jacrev):
        by_x = jax.vmap(derivative(function), in_axes=(0, None))(x, jnp.asarray(width))
        assert bool(jnp.isfinite(by_x).all())
        by_width = jax.vmap(derivative(function, argnums=1), in_axes=(0, None))(x, jnp.asarray(width))
        assert bool(jnp.isfinite(by_width).all())


@pytest.mark.parametrize("span", [4.0, 1e3, 1e5, 1e6])
@pytest.mark.parametrize(("ours", "numpys"), [(smooth.sine, np.sin), (smooth.cosine, np.cos)])
def test_sine_and_cosine_to_5e_16(ours, numpys, span):
    angles = np.random.default_rng(0).uniform(-span, span, 100000)
    half_turns = np.arange(-20, 21) * (span / 40)
    for points in (angles, half_turns, np.round(angles / np.pi) * np.pi, (np.round(angles / np.pi) + 0.5) * np.pi):
        for values in (ours(jnp.asarray(points)), jax.jit(ours)(jnp.asarray(points))):
            assert np.abs(np.asarray(values) - numpys(points)).max() < 5e-16


def test_sine_and_cosine_are_each_others_derivatives():
    angles = jnp.linspace(-50.0, 50.0, 1001)
    for transform in (jax.grad, jax.jacfwd):
        np.testing.assert_array_equal(jax.vmap(transform(smooth.sine))(angles), smooth.cosine(angles))
        np.testing.assert_array_equal(jax.vmap(transform(smooth.cosine))(angles), -smooth.sine(angles))
    np.testing.assert_array_equal(jax.vmap(jax.grad(jax.grad(smooth.sine)))(angles), -smooth.sine(angles))


def test_sine_and_cosine_together():
    angles = np.linspace(0.0, 2.0 * np.pi, 10_001)
    s, c = smooth.sine_cosine(jnp.asarray(angles))
    np.testing.assert_allclose(s, np.sin(angles), rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(c, np.cos(angles), rtol=0.0, atol=2e-15)
    small = np.linspace(-0.2, 0.2, 101)
    s, c = smooth.small_rotation(jnp.asarray(small))
    np.testing.assert_allclose(s, np.sin(small), rtol=1e-13, atol=1e-18)
    np.testing.assert_allclose(c, np.cos(small), rtol=1e-13)
