from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import QuadraticDrag


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(QuadraticDrag(3.0))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -3.0 * v * abs(v)))
