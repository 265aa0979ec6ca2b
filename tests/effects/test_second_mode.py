import numpy as np

from tests.effects.rig import START, Reference, assert_same, simulate, sine
from vibrojax.effects import SecondMode

M_2, F_2, ZETA_2 = 0.03, 30.0, 0.02
K_2, C_2 = M_2 * (2 * np.pi * F_2) ** 2, 2 * ZETA_2 * M_2 * 2 * np.pi * F_2


class WithMode(Reference):
    """States x, v of the hammer and x2, v2 of the mode, all absolute."""

    def __init__(self):
        y, v, _ = sine(0.0)
        super().__init__(own=[START[0] + y, START[1] + v], own_rates=self.mode)

    def rates(self, t, state, touching):
        x, v, x2, v2 = state
        self.extra = lambda *_: K_2 * (x2 - x) + C_2 * (v2 - v)
        return super().rates(t, state, touching)

    def mode(self, t, x, v, z, pushed, a):
        return [z[1], (K_2 * (x - z[0]) + C_2 * (v - z[1])) / M_2]


def test_agrees_with_an_independent_integration():
    readings, trajectory = simulate(SecondMode(M_2, F_2, ZETA_2))
    assert_same(readings, WithMode())
    u, _, z, _ = WithMode()()
    x = u + sine(np.asarray(trajectory.ts))[0]
    np.testing.assert_allclose(trajectory.own[:, 0], z[:, 0] - x, atol=1e-5 * np.abs(z[:, 0] - x).max())
