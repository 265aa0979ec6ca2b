import pytest

from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import QuinticStiffness


@pytest.mark.parametrize("k_5", [6e10, -6e9])
def test_agrees_with_an_independent_integration(k_5):
    readings, _ = simulate(QuinticStiffness(k_5))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -k_5 * u**5))
