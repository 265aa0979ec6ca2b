"""What holds for every listed suspension, and the linear one's signs."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from vibrojax.suspension import SUSPENSIONS, Free, Linear, Pendulum, Pivot

EXAMPLES = (
    Linear(damping_ratio=0.03, natural_frequency_hz=2.5),
    Pendulum(damping_ratio=0.03, natural_frequency_hz=2.5, length=0.09),
    Pivot(damping_ratio=0.03, natural_frequency_hz=2.5, length=0.4),
    Free(),
)
each_suspension = pytest.mark.parametrize("suspension", EXAMPLES, ids=[example.name for example in EXAMPLES])
POINTS = ((0.01, 0.2, 3.0), (-0.05, -0.1, 0.0), (0.0, 0.0, -1.0))


def test_every_listed_suspension_is_tested():
    assert {example.name for example in EXAMPLES} == set(SUSPENSIONS)


@pytest.mark.parametrize("name", SUSPENSIONS)
def test_parameters_describe_the_estimated_fields(name):
    estimated = [field.name for field in dataclasses.fields(SUSPENSIONS[name]) if not field.metadata.get("static")]
    assert [parameter.field for parameter in SUSPENSIONS[name].parameters] == estimated


@each_suspension
@pytest.mark.parametrize("point", POINTS)
def test_forward_reverse_and_central_differences_agree(suspension, point):
    vector, restore = ravel_pytree((jax.tree.map(jnp.asarray, suspension), tuple(jnp.asarray(p) for p in point)))

    def acceleration(vector):
        suspension, motion = restore(vector)
        return suspension.acceleration(*motion)

    forward = jax.jacfwd(acceleration)(vector)
    np.testing.assert_allclose(forward, jax.jacrev(acceleration)(vector), rtol=1e-13, atol=1e-15)
    steps = 1e-5 * jnp.eye(vector.size)
    central = jax.vmap(lambda step: acceleration(vector + step) - acceleration(vector - step))(steps) / 2e-5
    np.testing.assert_allclose(forward, central, rtol=1e-6, atol=1e-8)


@each_suspension
def test_plain_jit_vmap_and_lanes_agree(suspension):
    motion = jnp.asarray(POINTS).T
    plain = jnp.stack([suspension.acceleration(*(jnp.asarray(p) for p in point)) for point in POINTS])
    np.testing.assert_allclose(suspension.acceleration(*motion), plain, rtol=1e-14)
    np.testing.assert_allclose(jax.jit(suspension.acceleration)(*motion), plain, rtol=1e-13)
    lanes = jax.tree.map(lambda leaf: jnp.full(3, leaf), suspension)
    in_axes = (0 if jax.tree.leaves(lanes) else None, 1)
    np.testing.assert_allclose(jax.vmap(lambda s, motion: s.acceleration(*motion), in_axes=in_axes)(lanes, motion), plain, rtol=1e-14)


def test_linear_pulls_back_and_brakes():
    suspension, zero, one = Linear(damping_ratio=0.1, natural_frequency_hz=2.0), jnp.asarray(0.0), jnp.asarray(1.0)
    omega = 4 * np.pi
    assert suspension.acceleration(one, zero, zero) == pytest.approx(-(omega**2), rel=1e-14)
    assert suspension.acceleration(zero, one, zero) == pytest.approx(-0.2 * omega, rel=1e-14)
    assert suspension.acceleration(zero, zero, one) == 1.0


def test_linear_solution_satisfies_its_equation():
    zeta, omega = 0.05, 2 * np.pi * 3.0
    root = omega * np.sqrt(1 - zeta**2)
    t = jnp.linspace(0.0, 1.0, 50)

    def decay(t):
        return 0.01 * jnp.exp(-zeta * omega * t) * jnp.cos(root * t)

    velocity = jax.grad(decay)
    acceleration = jax.vmap(jax.grad(velocity))(t)
    suspension = Linear(damping_ratio=zeta, natural_frequency_hz=3.0)
    np.testing.assert_allclose(suspension.acceleration(decay(t), jax.vmap(velocity)(t), jnp.zeros_like(t)), acceleration, atol=1e-12)


def test_free_only_follows_its_drive():
    assert Free().acceleration(jnp.asarray(1.0), jnp.asarray(2.0), jnp.asarray(3.0)) == 3.0
