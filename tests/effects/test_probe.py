"""Candidates take their times from the rig: one that is a thousand times as fast is asked the same."""

import dataclasses

import pytest

from tests.effects.scales import SCALES
from vibrojax.effects import EFFECTS, ProbeScales

FASTER = 1000.0
FAST = dataclasses.replace(
    SCALES,
    f_n=FASTER * SCALES.f_n,
    clock={file: (first / FASTER, last / FASTER) for file, (first, last) in SCALES.clock.items()},
    contact_time=SCALES.contact_time / FASTER,
    sampling=SCALES.sampling / FASTER,
)


def probed(name: str, field: str, scales: ProbeScales) -> list[float]:
    """A parameter of all candidates of an effect."""
    return [float(getattr(member, field)) for members in EFFECTS[name].probe.candidates(scales) for member in members]


@pytest.mark.parametrize(
    ("name", "field"),
    [("second_mode", "mode_frequency_hz"), ("cart_recoil", "cart_frequency_hz"), ("stop_compliance", "stop_frequency_hz")],
)
@pytest.mark.parametrize("f_n", [0.0, 5.0])
def test_frequencies_go_with_the_rig(name, field, f_n):
    slow, fast = (dataclasses.replace(scales, f_n=f_n * times) for scales, times in ((SCALES, 1.0), (FAST, FASTER)))
    found = probed(name, field, slow)
    assert len(found) > 10
    assert probed(name, field, fast) == pytest.approx([FASTER * f for f in found])


@pytest.mark.parametrize(
    ("name", "field"),
    [("force_lag", "lag"), ("time_offset", "delay"), ("sensor_high_pass", "time_constant"), ("recorder_low_pass", "time_constant")],
)
def test_lags_go_with_contact_and_sampling(name, field):
    assert probed(name, field, FAST) == pytest.approx([lag / FASTER for lag in probed(name, field, SCALES)])


def test_no_mode_is_tried_that_the_records_cannot_show():
    """Three periods in the longest record, and somewhat below half of the sampling rate."""
    found = probed("second_mode", "mode_frequency_hz", dataclasses.replace(SCALES, f_n=0.0))
    assert (min(found), max(found)) == (pytest.approx(3.0 / 3.0), pytest.approx(0.4 / SCALES.sampling))
    assert probed("second_mode", "mode_frequency_hz", dataclasses.replace(SCALES, f_n=0.0, clock={"drop.csv": (0.0, 1e-3)})) == []


def test_modes_are_tried_right_beside_the_natural_frequency():
    found = probed("second_mode", "mode_frequency_hz", SCALES)
    assert min(abs(f / SCALES.f_n - 1.0) for f in found) < 0.05
