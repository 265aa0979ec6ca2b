import jax.numpy as jnp
import numpy as np

from tests.effects.rig import Reference, assert_same, simulate, sine
from vibrojax.effects import Hysteresis, Motion

F_H, D = 0.1, 1e-3


def memory(t, x, v, z, pushed, a):
    relative = v - sine(t)[1]
    return [(relative - 0.5 * abs(relative) * z[0] - 0.5 * relative * abs(z[0])) / D]


def test_agrees_with_an_independent_integration():
    readings, trajectory = simulate(Hysteresis(F_H, D))
    reference = Reference(extra=lambda t, u, v, z: -F_H * z[0], own_rates=memory, own=[0.0])
    assert_same(readings, reference)
    np.testing.assert_allclose(trajectory.own[:, 0], reference()[2][:, 0], atol=1e-4)


def test_saturates_at_one_and_unloads_in_a_straight_line():
    def rate(v, z):
        zero = jnp.asarray(0.0)
        motion = Motion(t=zero, u=zero, v=jnp.asarray(v), indentation=zero, indentation_rate=zero, in_contact=jnp.asarray(False))
        return float(Hysteresis(F_H, D).rates(motion, jnp.asarray([z]), zero, zero)[0])

    assert rate(0.2, 1.0) == rate(-0.2, -1.0) == 0.0
    np.testing.assert_allclose([rate(-0.2, 1.0), rate(-0.2, 0.3)], -0.2 / D, rtol=1e-15)
