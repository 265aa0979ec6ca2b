import jax.numpy as jnp
import numpy as np

from tests.effects.rig import A0, OMEGA, PHASE, Reference, assert_same, simulate
from vibrojax.effects import FrequencyDrift
from vibrojax.excitation import at_rest

RATE = 0.1


def cart(t, z):
    angle = OMEGA * (t + 0.5 * RATE * t**2) + PHASE
    return A0 * np.sin(angle), A0 * OMEGA * (1 + RATE * t) * np.cos(angle)


def test_agrees_with_an_independent_integration():
    readings, trajectory = simulate(FrequencyDrift(RATE))
    assert_same(readings, Reference(cart=cart))
    np.testing.assert_allclose(readings["cart_displacement"], cart(np.asarray(trajectory.ts), [])[0], atol=1e-15)


def test_a_cart_at_rest_stays_there():
    base, t = FrequencyDrift(RATE).base(at_rest()), jnp.asarray([0.0, 1.0])
    for motion in (base.displacement(t), base.velocity(t), base.acceleration(t)):
        np.testing.assert_array_equal(motion, 0.0)
