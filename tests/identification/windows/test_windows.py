"""Cutting of records into windows."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.estimation.held_back import LONG
from identification.estimation.short_windows import SHORT
from identification.experiment import Record
from identification.windows.kinematics import Kinematics
from identification.windows.windows import WindowLength, cut


def record_with(touching: np.ndarray) -> tuple[Record, Kinematics]:
    """A record whose hammer is in contact where stated."""
    blank = np.zeros(len(touching))
    record = Record(file="a.csv", kind="drop-test", gap=0.0, time=1e-3 * np.arange(len(touching)))
    motion = Kinematics(u=blank, v=blank, a=blank, base_acceleration=blank, force=None, inertia=blank, touching=touching)
    return record, motion


@given(samples=st.integers(200, 3000), length=st.integers(64, 1000), seed=st.integers(0, 99))
def test_windows_tile_the_record(samples, length, seed):
    """Every sample belongs to exactly one window, in order."""
    touching = np.repeat(np.random.default_rng(seed).random(samples // 20 + 1) < 0.2, 20)[:samples]
    parts = cut(*record_with(touching), length)
    assert parts[0][0] == 0
    assert sum(n for _, n in parts) == samples
    assert all(first + n == following for (first, n), (following, _) in zip(parts[:-1], parts[1:], strict=True))


def test_borders_avoid_contact():
    """A border that would fall into an impact moves into the flight beside it."""
    touching = np.zeros(2000, bool)
    touching[990:1030] = True
    (_, _), (border, _) = cut(*record_with(touching), 1000)
    assert not touching[border]
    assert np.abs(np.flatnonzero(touching) - border).min() > 100


@pytest.mark.parametrize(("impacts", "expected"), [(0, 1000), (4, 1000), (40, 200)])
def test_window_length_follows_the_impacts(impacts, expected):
    """About two impacts a window, within the limits."""
    touching = np.zeros(4000, bool)
    for k in range(impacts):
        touching[50 + 95 * k : 60 + 95 * k] = True
    assert WindowLength().samples(*record_with(touching)) == expected


@pytest.mark.parametrize("kind", ["free-decay", "forced"])
@pytest.mark.parametrize(("samples", "period", "expected"), [(4000, 50, 1000), (4000, 500, 2000), (4000, 3000, 4000), (9000, 3000, 4096)])
def test_motion_without_impacts_is_cut_into_several_periods_even_where_others_are_short(kind, samples, period, expected):
    """What brakes a swing hardly shows within one period, and nothing there makes errors grow."""
    record, motion = record_with(np.zeros(samples, bool))
    motion = dataclasses.replace(motion, u=np.cos(2.0 * np.pi * (np.arange(samples) + 0.5) / period))
    calm = dataclasses.replace(record, kind=kind)
    assert SHORT.samples(record, motion) == 170
    assert SHORT.samples(calm, motion) == expected
    assert LONG.samples(calm, motion) == min(samples, 4096)


def test_forced_motion_with_impacts_is_cut_into_short_windows():
    """Impacts make errors grow, whatever drives the hammer."""
    touching = np.zeros(4000, bool)
    touching[:1010] = True
    record, motion = record_with(touching)
    forced = dataclasses.replace(record, kind="forced")
    assert SHORT.samples(forced, motion) == SHORT.samples(forced, None) == 170
