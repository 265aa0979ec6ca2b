import jax.numpy as jnp
import pytest

from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import AsymmetricDamping, Motion


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(AsymmetricDamping(1.6))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -(0.8 if v > 0.0 else -0.8) * v))


@pytest.mark.parametrize(("velocity", "coefficient"), [(0.3, 2.5), (-0.3, 1.5)])
def test_the_coefficients_of_the_two_directions_lie_about_the_nominal_one(velocity, coefficient):
    zero = jnp.zeros(())
    motion = Motion(t=zero, u=zero, v=jnp.asarray(velocity), indentation=zero, indentation_rate=zero, in_contact=jnp.asarray(False))
    nominal = -2.0 * velocity
    assert float(nominal + AsymmetricDamping(1.0).force(motion, jnp.zeros(0))) == pytest.approx(-coefficient * velocity)
