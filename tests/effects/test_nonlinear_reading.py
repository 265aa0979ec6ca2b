import dataclasses

import numpy as np
import pytest

from benchmarks.simulator.faults import Curve
from tests.effects.scales import SCALES
from tests.effects.sensor import shown, unheard
from vibrojax.effects import NonlinearReading
from vibrojax.effects.base import unit_in


@pytest.mark.parametrize("channel", ["hammer_displacement", "impact_force", "cart_acceleration"])
def test_agrees_with_the_independent_simulator(channel):
    size = {"hammer_displacement": 5e-3, "impact_force": 80.0, "cart_acceleration": 5.0}[channel]
    effect = NonlinearReading(0.03 / size, -0.02 / size**2, channel)
    reading, value, ts = shown(effect)
    curve = Curve(channel=channel, quadratic=0.03 / size, cubic=-0.02 / size**2)
    np.testing.assert_allclose(reading, curve.distort("", ts, value), rtol=1e-14)
    assert np.abs(reading - value).max() > 0.01 * size
    assert unheard(effect)


def test_candidates_bend_the_largest_reading_by_a_hundredth():
    square, cube = NonlinearReading.probe.candidates(SCALES)[1]
    assert square.of_channel == cube.of_channel == "impact_force"
    assert (square.cubic, cube.quadratic) == (0.0, 0.0)
    largest = max(SCALES.force, SCALES.flight_force)
    assert square.quadratic * largest**2 == pytest.approx(cube.cubic * largest**3) == pytest.approx(0.01 * largest)
    still = dataclasses.replace(SCALES, amplitude=0.0, speed=0.0, force=0.0)
    assert NonlinearReading.probe.candidates(still) == ()


def test_its_units_are_those_of_the_channel():
    square, cube = NonlinearReading.parameters
    assert [unit_in(p.unit, "hammer_displacement") for p in (square, cube)] == ["1/m", "1/m^2"]
    assert [unit_in(p.unit, "hammer_acceleration") for p in (square, cube)] == ["1/(m/s^2)", "1/(m/s^2)^2"]
