import numpy as np

from tests.effects.rig import Reference, assert_same, simulate, sine
from vibrojax.effects import CartRecoil

M_C, F_C, ZETA_C = 4.0, 18.0, 0.08
K_C, C_C = M_C * (2 * np.pi * F_C) ** 2, 2 * ZETA_C * M_C * 2 * np.pi * F_C


def cart(t, z):
    y, v, _ = sine(t)
    return y + z[0], v + z[1]


def recoil(t, x, v, z, pushed, a):
    return [z[1], (pushed - C_C * z[1] - K_C * z[0]) / M_C]


def test_agrees_with_an_independent_integration():
    readings, trajectory = simulate(CartRecoil(M_C, F_C, ZETA_C))
    reference = Reference(cart=cart, own=[0.0, 0.0], own_rates=recoil)
    assert_same(readings, reference)
    _, pushed, z, _ = reference()
    ts = np.asarray(trajectory.ts)
    np.testing.assert_allclose(readings["cart_displacement"], sine(ts)[0] + z[:, 0], atol=1e-5 * np.abs(z[:, 0]).max())
    jolt = (pushed - C_C * z[:, 1] - K_C * z[:, 0]) / M_C
    np.testing.assert_allclose(readings["cart_acceleration"], sine(ts)[2] + jolt, atol=1e-5 * np.abs(jolt).max())
