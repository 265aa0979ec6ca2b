from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import ConstantForce


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(ConstantForce(0.2))
    assert_same(readings, Reference(extra=lambda t, u, v, z: 0.2))
