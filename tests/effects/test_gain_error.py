import dataclasses

import numpy as np
import pytest

from tests.effects.scales import SCALES
from tests.effects.sensor import shown, unheard
from vibrojax.effects import GainError


@pytest.mark.parametrize("channel", ["hammer_displacement", "impact_force", "cart_acceleration"])
def test_multiplies_its_channel(channel):
    reading, value, _ = shown(GainError(1.07, channel))
    np.testing.assert_allclose(reading, 1.07 * value, rtol=1e-15)
    assert unheard(GainError(1.07, channel))


def test_strength_is_the_distance_from_one():
    assert GainError(1.5, "impact_force").scaled(0.5) == GainError(1.25, "impact_force")
    assert GainError(1.5, "impact_force").scaled(-1.0) == GainError(0.5, "impact_force")


def test_the_gain_of_the_only_channel_is_the_unit_of_length():
    assert GainError.probe.candidates(SCALES)
    assert not GainError.probe.candidates(dataclasses.replace(SCALES, tied=False))
