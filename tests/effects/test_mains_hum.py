import dataclasses

import numpy as np
import pytest

from tests.effects.scales import SCALES
from tests.effects.sensor import shown, unheard
from vibrojax.effects import MainsHum

HUM = MainsHum(frequency_hz=50.0, sine=3e-5, cosine=-1e-5, of_channel="hammer_displacement")


def test_adds_a_line_to_its_channel():
    reading, value, ts = shown(HUM)
    line = 3e-5 * np.sin(2 * np.pi * 50.0 * ts) - 1e-5 * np.cos(2 * np.pi * 50.0 * ts)
    np.testing.assert_allclose(reading - value, line, atol=1e-17 + 1e-12 * 3e-5)
    assert unheard(HUM)


def test_members_of_its_candidate_are_sine_and_cosine():
    (candidate,) = MainsHum.probe.candidates(dataclasses.replace(SCALES, lines={"impact_force": (50.0,)}))
    sine, cosine = candidate
    assert (sine.sine, sine.cosine, cosine.sine, cosine.cosine) == (0.15, 0.0, 0.0, 0.15)
    assert MainsHum.probe.joined(candidate) == MainsHum(50.0, 0.15, 0.15, "impact_force")


@pytest.mark.parametrize(
    ("line", "heard"), [(12.0, False), (31.4, True), (36.5, False), (37.5, False), (50.0, True), (49.9, True), (1200.0, False)]
)
def test_multiples_of_the_drive_are_no_hum_unless_they_are_the_mains(line, heard):
    scales = dataclasses.replace(SCALES, drives=(2 * np.pi * 7.3, 2 * np.pi * 12.5), lines={"hammer_displacement": (line,)})
    assert bool(MainsHum.probe.candidates(scales)) == heard


@pytest.mark.parametrize(("seconds", "heard"), [(0.19, False), (0.6, True)])
def test_a_line_of_a_few_cycles_is_none(seconds, heard):
    """An impact on an air track takes a fifth of a second."""
    clock = {"a.csv": (0.0, seconds), "b.csv": (1.0, 1.0 + seconds), "c.csv": (0.0, 100.0)}
    scales = dataclasses.replace(SCALES, drives=(), clock=clock, lines={"hammer_displacement": (30.0,)})
    assert bool(MainsHum.probe.candidates(scales)) == heard
