from tests.effects.rig import GAP, Reference, assert_same, simulate
from vibrojax.effects import GapDrift


def test_agrees_with_an_independent_integration():
    # Exaggerated, so that the rate of the stop shows in the damping of its force.
    readings, _ = simulate(GapDrift(5e-3))
    assert_same(readings, Reference(gap=lambda t, z: (GAP + 5e-3 * t, 5e-3)))
