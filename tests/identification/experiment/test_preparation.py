"""Crop, low-pass, decimation, resampling and removal of a trend, declared in the record."""

import dataclasses

import numpy as np
import pytest

from identification.experiment import ExperimentError, load_experiment
from identification.result.files import provenance
from tests.identification.made_result import made_result

RATE, NOISE = 4000.0, 1e-4
TIME = np.arange(8000) / RATE

EXPERIMENT = """\
schema = 1
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[sensors.hammer_displacement]
unit = "m"
[[record]]
file = "a.npz"
kind = "free-decay"
gap = 1.0
"""


def swing(time=TIME):
    return 0.2 * np.sin(2.0 * np.pi * 5.0 * time)


def loaded(folder, declared, values, *, time=TIME, noise=""):
    np.savez(folder / "a.npz", time=time, hammer_displacement=values)
    (folder / "experiment.toml").write_text(EXPERIMENT.replace('unit = "m"', f'unit = "m"\n{noise}') + declared + "\n")
    return load_experiment(folder).records[0]


def noisy(values, seed=3):
    return values + np.random.default_rng(seed).normal(0.0, NOISE, values.size)


def test_a_crop_keeps_the_files_own_clock(tmp_path):
    record = loaded(tmp_path, "crop = [0.5, 1.5]", noisy(swing()))
    assert (record.time[0], record.time[-1], record.time.size) == (0.5, 1.5, 4001)
    assert "Prepared as declared: crop to 0.5 to 1.5 s." in record.notices
    assert record.noise["hammer_displacement"] == pytest.approx(NOISE, rel=0.05)


def test_a_low_pass_keeps_the_swing_its_phase_and_what_is_left_of_the_noise(tmp_path):
    hum = 0.1 * np.sin(2.0 * np.pi * 800.0 * TIME)
    record = loaded(tmp_path, "lowpass = 200.0", noisy(swing() + hum))
    left = (record.channels["hammer_displacement"] - swing())[400:-400]
    assert np.std(left) < 0.5 * NOISE


@pytest.mark.parametrize(
    "declared", ["lowpass = 200.0", "decimate = 5", "resample = 1000.0", "lowpass = 300.0\ndecimate = 4", "resample = 1500.0"]
)
@pytest.mark.parametrize("noise", ["", f"noise = {NOISE}"])
def test_the_noise_is_that_behind_the_filter(declared, noise, tmp_path):
    record = loaded(tmp_path, declared, noisy(swing()), noise=noise)
    left = (record.channels["hammer_displacement"] - swing(record.time))[record.time.size // 10 : -record.time.size // 10]
    assert record.noise["hammer_displacement"] == pytest.approx(float(np.std(left)), rel=0.1)
    assert record.noise["hammer_displacement"] < 0.8 * NOISE


@pytest.mark.parametrize("declared", ["decimate = 8", "resample = 500.0"])
def test_what_is_too_fast_for_the_new_rate_does_not_fold_back(declared, tmp_path):
    folds = 0.1 * np.sin(2.0 * np.pi * 505.0 * TIME)  # would show at 5 Hz
    record = loaded(tmp_path, declared, noisy(swing() + folds))
    assert 1.0 / np.median(np.diff(record.time)) == pytest.approx(500.0, rel=1e-6)
    left = (record.channels["hammer_displacement"] - swing(record.time))[100:-100]
    assert np.std(left) < 5e-2 * 0.1


def test_uneven_samples_are_put_onto_even_ones(tmp_path):
    time = TIME + np.random.default_rng(1).uniform(-0.1, 0.1, TIME.size) / RATE
    with pytest.raises(ExperimentError, match=r"its samples come unevenly, .*set resample = 4.* \(Hz\) in place of lowpass or decimate"):
        loaded(tmp_path, "lowpass = 100.0", noisy(swing(time)), time=time)
    record = loaded(tmp_path, "resample = 2000.0", noisy(swing(time)), time=time)
    assert np.ptp(np.diff(record.time)) < 1e-9
    left = (record.channels["hammer_displacement"] - swing(record.time))[100:-100]
    assert np.std(left) < 1.2 * NOISE


def test_a_trend_is_taken_out_of_the_channel_that_is_named(tmp_path):
    record = loaded(tmp_path, 'detrend = { hammer_displacement = "linear" }', noisy(0.3 + 0.5 * TIME))
    np.testing.assert_allclose(record.channels["hammer_displacement"], 0.0, atol=6 * NOISE)
    record = loaded(tmp_path, 'detrend = { hammer_displacement = "constant" }', noisy(0.3 + 0.5 * TIME))
    assert record.channels["hammer_displacement"][-1] == pytest.approx(0.5, abs=6 * NOISE)
    assert "Prepared as declared: mean taken out of hammer_displacement." in record.notices


def test_missing_samples_stay_missing_behind_a_filter(tmp_path):
    values = noisy(swing())
    values[1000:1010] = np.nan
    record = loaded(tmp_path, "lowpass = 400.0", values)
    assert np.flatnonzero(np.isnan(record.channels["hammer_displacement"])).tolist() == list(range(995, 1015))
    assert any("were bridged by straight lines for the filter, and are left out" in notice for notice in record.notices)


@pytest.mark.parametrize("hole", [1000, 1001, 1002, 1003])
def test_a_single_missing_sample_is_not_lost_between_those_that_are_kept(hole, tmp_path):
    """Every fourth sample is kept, whichever of them is missing."""
    values = noisy(swing())
    values[hole] = np.nan
    missing = np.flatnonzero(np.isnan(loaded(tmp_path, "decimate = 4", values).channels["hammer_displacement"]))
    assert 1 <= len(missing) <= 3 and np.abs(4 * missing - hole).min() <= 3


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("crop = [1.0]", r"crop in record 'a.npz' is \[1.0\]: expected two numbers in s"),
        ("crop = [1.0, 0.5]", r"expected the lower number first"),
        ("crop = [5.0, 6.0]", r"crop of record 'a.npz' leaves 0 samples between 5 and 6 s: .*runs from 0 to 1.99975 s"),
        ("lowpass = 2500.0", r"lowpass of record 'a.npz' is 2500 Hz: expected less than half its sampling rate, 2000 Hz"),
        ("lowpass = -1.0", r"lowpass in record 'a.npz' is -1.0: expected a finite number above 0 in Hz"),
        ("decimate = 1", r"decimate in record 'a.npz' is 1: expected a whole number from 2 on"),
        ("decimate = 2.0", r"decimate .* is 2.0: expected a whole number"),
        ("decimate = 1000", r"preparation leaves 8 samples of record 'a.npz': expected at least 16"),
        (f"decimate = 1{400 * '0'}", r"preparation leaves 1 samples of record 'a.npz': expected at least 16"),
        ("decimate = 2\nresample = 100.0", r"has both decimate and resample: expected one of the two"),
        ("resample = 1e9", r"resample of record 'a.npz' is 1e\+09 Hz, and it comes at 4000 Hz: expected a rate nearer"),
        ('detrend = "linear"', r"detrend of record 'a.npz' is 'linear': expected a table"),
        ('detrend = { hammer = "linear" }', r"unknown channel 'hammer' in detrend of record 'a.npz'"),
        (
            'detrend = { hammer_displacement = "cubic" }',
            r"unknown hammer_displacement 'cubic' in detrend .*: expected one of constant",
        ),
    ],
)
def test_what_no_preparation_can_be(declared, message, tmp_path):
    with pytest.raises(ExperimentError, match=message):
        loaded(tmp_path, declared, noisy(swing()))


def test_it_is_kept_in_the_provenance(tmp_path):
    record = loaded(tmp_path, "crop = [0.5, 1.5]\ndecimate = 2", noisy(swing()))
    result = made_result()
    assert "preparation" not in provenance(result)
    changed = dataclasses.replace(result, experiment=dataclasses.replace(result.experiment, records=(record,)))
    assert provenance(changed)["preparation"] == {
        "a.npz": {"crop": [0.5, 1.5], "mask": [], "lowpass": None, "decimate": 2, "resample": None, "detrend": {}}
    }


def test_an_initial_state_does_not_hold_after_a_crop_that_takes_the_beginning_away(tmp_path):
    for name in ("initial_displacement", "initial_velocity"):
        with pytest.raises(
            ExperimentError, match=rf"{name} in record 'a.npz' is given beside a crop that begins at 0.5 s, 0.5 s after"
        ) as told:
            loaded(tmp_path, f"crop = [0.5, 1.5]\n{name} = 0.0", noisy(swing()))
        assert "\n" not in str(told.value) and f"remove {name}, or begin the crop with the file" in str(told.value)
        kept = loaded(tmp_path, f"crop = [0.0, 1.5]\n{name} = 0.25", noisy(swing()))
        assert getattr(kept, name) == 0.25


@pytest.mark.parametrize("lowest", [0.5, 1e-7, 1e-300])
def test_a_cut_off_below_what_the_record_shows_is_refused(tmp_path, lowest):
    with pytest.raises(ExperimentError, match=r"lowpass of record 'a.npz' is .* Hz: expected more than one over its duration, 0.500063 Hz"):
        loaded(tmp_path, f"lowpass = {lowest!r}", noisy(swing()))
