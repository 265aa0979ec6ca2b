"""Candidates take their times from the rig: one that is a thousand times as fast is asked the same."""

import dataclasses

import pytest

from identification.diagnosis.score.scored import blank
from tests.effects.facts import FACTS
from vibrojax.effects import EFFECTS, Facts

FASTER = 1000.0
FAST = dataclasses.replace(
    FACTS,
    f_n=FASTER * FACTS.f_n,
    clock={file: (first / FASTER, last / FASTER) for file, (first, last) in FACTS.clock.items()},
    contact_time=FACTS.contact_time / FASTER,
    sampling=FACTS.sampling / FASTER,
)


def probed(name: str, field: str, facts: Facts) -> list[float]:
    """What the probes of an effect have for a parameter."""
    return [float(getattr(member, field)) for members in blank(EFFECTS[name]).probes(facts) for member in members]


@pytest.mark.parametrize(
    ("name", "field"),
    [("second_mode", "mode_frequency_hz"), ("cart_recoil", "cart_frequency_hz"), ("stop_compliance", "stop_frequency_hz")],
)
@pytest.mark.parametrize("f_n", [0.0, 5.0])
def test_frequencies_go_with_the_rig(name, field, f_n):
    slow, fast = (dataclasses.replace(facts, f_n=f_n * times) for facts, times in ((FACTS, 1.0), (FAST, FASTER)))
    found = probed(name, field, slow)
    assert len(found) > 10
    assert probed(name, field, fast) == pytest.approx([FASTER * f for f in found])


@pytest.mark.parametrize(("name", "field"), [("force_lag", "lag"), ("time_offset", "delay")])
def test_lags_go_with_contact_and_sampling(name, field):
    assert probed(name, field, FAST) == pytest.approx([lag / FASTER for lag in probed(name, field, FACTS)])


def test_no_mode_is_tried_that_the_records_cannot_show():
    """Three periods in the longest record, and somewhat below half of the sampling rate."""
    found = probed("second_mode", "mode_frequency_hz", dataclasses.replace(FACTS, f_n=0.0))
    assert (min(found), max(found)) == (pytest.approx(3.0 / 3.0), pytest.approx(0.4 / FACTS.sampling))
    assert probed("second_mode", "mode_frequency_hz", dataclasses.replace(FACTS, f_n=0.0, clock={"drop.csv": (0.0, 1e-3)})) == []


def test_modes_are_tried_right_beside_the_natural_frequency():
    found = probed("second_mode", "mode_frequency_hz", FACTS)
    assert min(abs(f / FACTS.f_n - 1.0) for f in found) < 0.05
