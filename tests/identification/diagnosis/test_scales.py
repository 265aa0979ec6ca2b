"""Scales from which candidates take their sizes: spectral lines, and what sets the size of the motion."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.scales import _is_known, _strongest
from identification.experiment import Load, Suspension
from tests.effects.scales import SCALES


def any_line(lines):
    return np.ones(len(lines), bool)


def test_a_tone_is_the_strongest_line_whatever_its_phase_in_each_record():
    rng, dt = np.random.default_rng(0), 0.01
    series = []
    for count, phase in ((3000, 0.3), (2000, 2.0)):
        time = dt * np.arange(count)
        series.append((rng.standard_normal(count) + 0.3 * np.sin(2.0 * np.pi * 3.21 * time + phase), dt))
    (line, _), searched = _strongest(series, any_line)
    assert line == pytest.approx(3.21, abs=0.05 / 30.0), "far less than the four lines a cycle that are searched"
    assert searched == pytest.approx(4 * 30.0 * 50.0, rel=0.01)  # four a cycle of the longest record, up to Nyquist's


def test_records_at_other_rates_count_up_to_their_own_band():
    rng = np.random.default_rng(1)
    fast = rng.standard_normal(4000) + 0.3 * np.sin(2.0 * np.pi * 60.0 * 0.005 * np.arange(4000))
    assert _strongest([(fast, 0.005), (rng.standard_normal(500), 0.02)], any_line)[0][0] == pytest.approx(60.0, abs=0.1)


def test_lines_of_the_motion_do_not_hide_a_weaker_one():
    time, scales = 0.004 * np.arange(5000), dataclasses.replace(SCALES, f_n=5.0, drives=(2.0 * np.pi * 7.3,))
    values = sum(size * np.sin(2.0 * np.pi * line * time) for size, line in ((1.0, 5.0), (0.8, 7.3), (0.5, 33.0), (0.3, 50.0)))
    found, _ = _strongest([(values + np.random.default_rng(2).standard_normal(5000), 0.004)], scales.is_foreign)
    assert found == pytest.approx((33.0, 50.0), abs=0.05)


def test_beside_a_line_of_the_motion_a_line_stays_where_it_may_be_one():
    time, scales = 0.004 * np.arange(2500), dataclasses.replace(SCALES, f_n=0.1, drives=(2.0 * np.pi * 8.0,))
    values = np.sin(2.0 * np.pi * 8.0 * time) + 1e-3 * np.random.default_rng(2).standard_normal(len(time))
    found, _ = _strongest([(values, 0.004)], scales.is_foreign)
    assert scales.is_foreign(np.array(found)).all()


def test_the_flank_of_the_motion_is_no_line():
    """A free decay of one record is no sharper than its length; a tone a hundredth of it stands far from there."""
    time, scales = np.arange(1000) / 30.0, dataclasses.replace(SCALES, f_n=1.2, drives=(), clock={"a.csv": (0.0, 1000 / 30.0)})
    decay = np.exp(-0.5 * time) * np.sin(2.0 * np.pi * 1.2 * time)
    noise = 1e-3 * np.random.default_rng(3).standard_normal(len(time))
    found, _ = _strongest([(decay + 0.01 * np.sin(2.0 * np.pi * 1.85 * time) + noise, 1.0 / 30.0)], scales.is_foreign)
    assert found[0] == pytest.approx(1.85, abs=0.01)


def test_a_series_that_is_too_short_has_no_line():
    assert _strongest([(np.ones(1), 0.1)], any_line) == ((), 0)


@pytest.mark.parametrize(
    "changes", [{"suspension": Suspension(kind="pendulum", length=0.5)}, {"load": Load(incline=0.1)}, {"load": Load(constant_force=1.0)}]
)
def test_a_length_or_a_load_sets_the_size_of_the_motion(small, changes):
    records = tuple(dataclasses.replace(record, base_amplitude=None) for record in small.records)
    bare = dataclasses.replace(small, records=records, load=Load(), suspension=Suspension(kind="linear"))
    assert not _is_known(bare)
    assert _is_known(dataclasses.replace(bare, **changes))


@pytest.mark.parametrize("changes", [{"base": "measured"}, {"base_amplitude": 1e-3}])
def test_a_known_motion_of_the_cart_does_too(small, changes):
    records = tuple(dataclasses.replace(record, base_amplitude=None) for record in small.records)
    bare = dataclasses.replace(small, records=records, load=Load(), suspension=Suspension(kind="linear"))
    moved = (*records[:-1], dataclasses.replace(records[-1], **changes))
    assert _is_known(dataclasses.replace(bare, records=moved))
