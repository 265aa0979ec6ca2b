import numpy as np

from tests.effects.sensor import shown, unheard
from vibrojax.effects import ForceClipping


def test_shows_nothing_above_the_ceiling_and_all_below():
    reading, force, _ = shown(ForceClipping(10.0))
    assert force.max() > 15.0
    np.testing.assert_array_equal(reading, np.minimum(force, 10.0))
    assert unheard(ForceClipping(10.0))
