import pytest

from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import CubicStiffness


@pytest.mark.parametrize("k_3", [2e6, -2e5])
def test_agrees_with_an_independent_integration(k_3):
    readings, _ = simulate(CubicStiffness(k_3))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -k_3 * u**3))
