import numpy as np

from tests.effects.rig import GAP, Reference, assert_same, simulate
from vibrojax.effects import StopCompliance

K_S, F_S, ZETA_S = 5e5, 480.0, 0.04
M_S = K_S / (2 * np.pi * F_S) ** 2
C_S = 2 * ZETA_S * np.sqrt(K_S * M_S)


def test_agrees_with_an_independent_integration_and_the_load_cell_is_behind_the_stop():
    readings, trajectory = simulate(StopCompliance(K_S, F_S, ZETA_S))
    reference = Reference(
        own_rates=lambda t, x, v, z, pushed, a: [z[1], (pushed - K_S * z[0] - C_S * z[1]) / M_S],
        own=[0.0, 0.0],
        gap=lambda t, z: (GAP + z[0], z[1]),
    )
    _, _, z, _ = reference()
    behind = K_S * z[:, 0] + C_S * z[:, 1]
    np.testing.assert_allclose(readings["impact_force"], behind, atol=1e-4 * behind.max())
    assert behind.min() < -0.02 * behind.max()
    assert_same({**readings, "impact_force": reference()[1]}, reference, within=1e-4)
