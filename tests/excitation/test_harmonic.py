"""The sine cart against NumPy and against its own derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from vibrojax.excitation import Harmonic, at_rest

BASE = Harmonic(base_amplitude=0.002, base_phase=0.7, frequency_hz=6.25)


@pytest.mark.parametrize("end", [1.0, 2500.0])
def test_against_numpy(end):
    t = np.linspace(0.0, end, 10001)  # up to |angle| = 1e5
    omega = 2.0 * np.pi * 6.25
    # the angle itself is rounded: one unit in its last place
    rounding = np.spacing(omega * end + 0.7) + 1e-15
    np.testing.assert_allclose(BASE.displacement(jnp.asarray(t)), 0.002 * np.sin(omega * t + 0.7), rtol=0, atol=0.002 * rounding)
    np.testing.assert_allclose(
        BASE.velocity(jnp.asarray(t)), 0.002 * omega * np.cos(omega * t + 0.7), rtol=0, atol=0.002 * omega * rounding
    )
    np.testing.assert_allclose(
        BASE.acceleration(jnp.asarray(t)), -0.002 * omega**2 * np.sin(omega * t + 0.7), rtol=0, atol=0.002 * omega**2 * rounding
    )


def test_velocity_and_acceleration_are_the_derivatives():
    t = jnp.linspace(0.0, 3.0, 301)
    np.testing.assert_allclose(jax.vmap(jax.grad(BASE.displacement))(t), BASE.velocity(t), atol=1e-15)
    np.testing.assert_allclose(jax.vmap(jax.grad(BASE.velocity))(t), BASE.acceleration(t), atol=1e-13)


def test_gradient_with_respect_to_amplitude_phase_and_frequency():
    t = jnp.asarray(0.37)
    base = jax.tree.map(jnp.asarray, BASE)
    angle = 2 * np.pi * 6.25 * 0.37 + 0.7
    for transform in (jax.jacfwd, jax.jacrev):
        gradient = transform(lambda base: base.displacement(t))(base)
        np.testing.assert_allclose(gradient.base_amplitude, np.sin(angle), rtol=1e-12)
        np.testing.assert_allclose(gradient.base_phase, 0.002 * np.cos(angle), rtol=1e-12)
        np.testing.assert_allclose(gradient.frequency_hz, 0.002 * np.cos(angle) * 2 * np.pi * 0.37, rtol=1e-12)


def test_plain_jit_vmap_and_lanes_agree():
    t = jnp.asarray([0.1, 0.2, 5.0])
    plain = BASE.acceleration(t)
    np.testing.assert_allclose(jax.jit(BASE.acceleration)(t), plain, rtol=1e-13)
    np.testing.assert_allclose(jax.vmap(BASE.acceleration)(t), plain, rtol=1e-14)
    lanes = Harmonic(base_amplitude=jnp.full(3, 0.002), base_phase=jnp.full(3, 0.7), frequency_hz=jnp.full(3, 6.25))
    np.testing.assert_allclose(jax.vmap(lambda base, t: base.acceleration(t))(lanes, t), plain, rtol=1e-14)


def test_at_rest():
    t = jnp.linspace(0.0, 10.0, 11)
    for motion in (at_rest().displacement, at_rest().velocity, at_rest().acceleration):
        np.testing.assert_array_equal(motion(t), 0.0)
