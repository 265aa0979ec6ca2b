"""Newton's restitution: the jump of the velocity."""

import jax
import jax.numpy as jnp
import numpy as np

from vibrojax.contact import Newton


def test_rebound_speed():
    speeds = jnp.asarray([0.0, 1e-6, 0.5, 3.0])
    np.testing.assert_allclose(Newton(restitution=0.8).rebound_speed(speeds), 0.8 * speeds, rtol=1e-15)


def test_plain_jit_vmap_and_lanes_agree():
    speeds, law = jnp.asarray([0.1, 0.5, 3.0]), Newton(restitution=jnp.asarray(0.8))
    plain = law.rebound_speed(speeds)
    np.testing.assert_array_equal(jax.jit(lambda law, v: law.rebound_speed(v))(law, speeds), plain)
    np.testing.assert_array_equal(jax.vmap(law.rebound_speed)(speeds), plain)
    lanes = Newton(restitution=jnp.full(3, 0.8))
    np.testing.assert_array_equal(jax.vmap(lambda law, v: law.rebound_speed(v))(lanes, speeds), plain)


def test_gradient():
    law, speed = Newton(restitution=jnp.asarray(0.8)), jnp.asarray(0.5)
    assert jax.grad(lambda v: law.rebound_speed(v))(speed) == 0.8
    assert jax.grad(lambda law: law.rebound_speed(speed))(law).restitution == 0.5
