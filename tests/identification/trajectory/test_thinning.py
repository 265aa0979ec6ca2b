"""Records that were sampled far more often than they change."""

import dataclasses

import numpy as np
import pytest

from identification.experiment import Record
from identification.trajectory.thinning import thinned

RATE, SECONDS, NOISE = 1000.0, 8.0, 1e-3
"""Hz, s, m"""
TIME = np.arange(int(RATE * SECONDS)) / RATE


def decay(*, tone_hz: float = 0.0, seed: int = 0) -> np.ndarray:
    """A swing of 2 Hz, m, with a faster tone beside it."""
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(TIME))
    return np.exp(-0.2 * TIME) * np.cos(4.0 * np.pi * TIME) + 0.02 * np.sin(2.0 * np.pi * tone_hz * TIME) + noise


def record(values: np.ndarray, time: np.ndarray = TIME) -> Record:
    return Record(
        file="decay.csv",
        kind="free-decay",
        gap=1.0,
        time=time,
        channels={"relative_displacement": values},
        noise={"relative_displacement": NOISE},
    )


def test_a_slow_swing_keeps_a_hundred_samples_a_period_its_motion_and_its_noise():
    (found,) = thinned([record(decay())])
    q = round(found.time[1] * RATE)
    assert q in (4, 5) and np.array_equal(found.time, TIME[::q])
    error = found.channels["relative_displacement"] - (np.exp(-0.2 * TIME) * np.cos(4.0 * np.pi * TIME))[::q]
    assert found.noise["relative_displacement"] < 0.6 * NOISE
    assert np.std(error[5:-5]) == pytest.approx(found.noise["relative_displacement"], rel=0.05)
    assert np.abs(np.mean(error)) < 1e-4
    assert "averaged" in found.notices[-1]


def test_what_is_faster_stays():
    (found,) = thinned([record(decay(tone_hz=150.0))])
    assert round(found.time[1] * RATE) == 2
    assert thinned([record(decay(tone_hz=300.0))])[0].time is TIME


def test_records_are_thinned_alike():
    slow, quick = thinned([record(decay()), record(decay(tone_hz=150.0, seed=1))])
    assert slow.time[1] == quick.time[1] == 2 / RATE


@pytest.mark.parametrize(
    "values",
    [
        np.where(np.arange(len(TIME)) == 50, np.nan, decay()),
        np.minimum(decay(), 0.8),
    ],
    ids=["gap", "plateau"],
)
def test_gaps_and_plateaus_are_left_as_they_are(values):
    assert thinned([record(values)])[0].channels["relative_displacement"] is values


@pytest.mark.parametrize("given", [{"kind": "forced"}, {"kind": "prescribed"}, {"kind": "cart-excitation", "base": "measured"}])
def test_a_measured_input_stays_as_it_is(given):
    assert thinned([dataclasses.replace(record(decay()), **given)])[0].time is TIME


def test_uneven_and_short_records_are_left_as_they_are():
    uneven = TIME + 0.2 / RATE * np.random.default_rng(2).random(len(TIME))
    assert thinned([record(decay(), uneven)])[0].time is uneven
    few = TIME[:60]
    assert len(thinned([record(np.cos(0.02 * np.pi * few * RATE), few)])[0].time) == 60
