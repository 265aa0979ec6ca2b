import numpy as np

from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import CoulombFriction


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(CoulombFriction(0.05))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -0.05 * np.tanh(v / 5e-4)), within=1e-4)
