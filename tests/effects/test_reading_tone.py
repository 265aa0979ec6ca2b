import dataclasses

import numpy as np
import pytest

from benchmarks.simulator.faults import Tone
from tests.effects.scales import SCALES
from tests.effects.sensor import shown, unheard
from vibrojax.effects import ReadingTone


@pytest.mark.parametrize("decay", [0.0, 4.0])
def test_agrees_with_the_independent_simulator(decay):
    tone = Tone(channel="hammer_displacement", amplitude=3e-5, frequency=23.0, decay=decay, phases={"a.csv": 0.7})
    effect = ReadingTone(23.0, decay, 3e-5 * np.cos(0.7), 3e-5 * np.sin(0.7), "hammer_displacement")
    reading, value, ts = shown(effect)
    np.testing.assert_allclose(reading, tone.distort("a.csv", ts, value), rtol=0, atol=1e-16)
    assert np.abs(reading - value).max() > 2e-5
    assert unheard(effect)


def found(**changes):
    return ReadingTone.probe.candidates(dataclasses.replace(SCALES, channels=("impact_force",), **changes))


def test_candidates_are_steady_and_decaying():
    steady, decaying = found(lines={"impact_force": (23.0,)})
    assert [(one.decay_rate, one.frequency_hz) for one in (*steady, *decaying)] == [(0.0, 23.0)] * 2 + [(1.0, 23.0)] * 2
    assert ReadingTone.probe.joined(steady) == ReadingTone(23.0, 0.0, 0.15, 0.15, "impact_force")


@pytest.mark.parametrize(("line", "heard"), [(3.0, False), (7.35, False), (10.3, True), (14.6, False), (23.0, True), (50.0, False)])
def test_no_tone_is_a_multiple_of_the_drive_or_a_line_of_the_mains_or_lasts_a_few_cycles(line, heard):
    assert bool(found(drives=(2 * np.pi * 7.3,), lines={"impact_force": (line,)})) == heard


@pytest.mark.parametrize(("line", "heard"), [(5.05, False), (5.2, False), (5.4, True), (10.3, True)])
def test_no_tone_is_the_free_motion(line, heard):
    """Nor what three seconds do not resolve from it."""
    assert bool(found(drives=(), f_n=5.0, lines={"impact_force": (line,)})) == heard
