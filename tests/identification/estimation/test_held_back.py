"""Records that no fit may see: kept from it, and predicted."""

import dataclasses
import shutil

import numpy as np
import pytest

from identification.estimation import held_back
from identification.estimation.estimate import fit_experiment
from identification.estimation.held_back import held_back_fits
from identification.experiment import ExperimentError, load_experiment
from identification.windows.prepare import prepare
from identification.windows.simulate import simulate_record
from identification.windows.windows import WindowLength
from tests.identification.conftest import cropped
from vibrojax.data_files import data_path
from vibrojax.effects import Hysteresis


@pytest.fixture(scope="module")
def parted(example):
    """Half a second of the drop test and of two cart records, the last held back."""
    short = cropped(example, 2000, (0, 1, 2))
    return dataclasses.replace(short, records=(*short.records[:2], dataclasses.replace(short.records[2], held_back=True)))


@pytest.fixture(scope="module")
def fitted(parted):
    return fit_experiment(parted)


def with_held_back(tmp_path, *, which: tuple[str, ...], value: str = "true"):
    folder = tmp_path / "rig"
    shutil.copytree(data_path("example"), folder)
    text = (folder / "experiment.toml").read_text()
    for name in which:
        text = text.replace(f'file = "{name}"', f'file = "{name}"\nheld_back = {value}')
    (folder / "experiment.toml").write_text(text)
    return folder


def test_an_experiment_says_which_records_are_held_back(tmp_path):
    experiment = load_experiment(with_held_back(tmp_path, which=("cart2.csv.gz",)))
    assert [record.file for record in experiment.held_back] == ["cart2.csv.gz"]
    assert [record.file for record in experiment.fitting.records] == ["drop.csv.gz", "cart1.csv.gz", "cart3.csv.gz"]
    assert len(experiment.records) == 4


def test_something_must_be_left_to_fit(tmp_path):
    every = ("drop.csv.gz", "cart1.csv.gz", "cart2.csv.gz", "cart3.csv.gz")
    with pytest.raises(ExperimentError, match=r"every record of experiment.toml is held back: expected at least one to fit"):
        load_experiment(with_held_back(tmp_path, which=every))


def test_held_back_is_true_or_false(tmp_path):
    with pytest.raises(ExperimentError, match=r"held_back in record 'drop.csv.gz' is 'yes': expected true or false"):
        load_experiment(with_held_back(tmp_path, which=("drop.csv.gz",), value='"yes"'))


def test_no_window_is_cut_from_a_held_back_record(parted):
    prepared = prepare(parted)
    assert [record.file for record in prepared.experiment.records] == [record.file for record in parted.records[:2]]
    assert set(prepared.record) == {0, 1}


def test_of_a_long_record_windows_spread_evenly_are_predicted(fitted, parted, monkeypatch):
    monkeypatch.setattr(held_back, "MOST_SAMPLES", 800.0)
    (whole,) = held_back_fits(parted, fitted.model)
    (thinned,) = held_back_fits(parted, fitted.model, window=WindowLength(longest=100))
    assert whole.samples == len(whole.time) > thinned.samples > 0.3 * len(whole.time)
    assert thinned.notices[-1].startswith(f"{thinned.samples} of {len(whole.time)} samples are taken, in windows spread evenly")
    assert thinned.chi2_reduced["impact_force"] == pytest.approx(1.0, abs=0.3)


def test_a_wrong_model_predicts_it_worse(fitted, parted):
    wrong = fitted.model.replace({"lambda_i": 0.7})
    (predicted,) = held_back_fits(parted, wrong)
    assert predicted.chi2_reduced["impact_force"] > 5.0


def test_nothing_held_back_is_nothing_predicted(parted, fitted):
    assert held_back_fits(parted.fitting, fitted.model) == ()


def test_a_model_with_effects_predicts_its_own_motion(parted, fitted):
    """An effect with a state of its own, which a window may begin with."""
    model = dataclasses.replace(fitted.model, effects=(Hysteresis(hysteresis_force=0.1, yield_displacement=1e-3),))
    record = parted.records[2]
    stated = dataclasses.replace(record, initial_displacement=0.0, initial_velocity=0.0)
    clean = simulate_record(model, stated)
    rng = np.random.default_rng(5)
    channels = {name: clean[name] + record.noise[name] * rng.standard_normal(len(record.time)) for name in record.channels}
    experiment = dataclasses.replace(parted, records=(parted.records[0], dataclasses.replace(record, channels=channels)))
    complete, bare = (
        held_back_fits(experiment, each, window=WindowLength())[0].chi2_reduced["hammer_displacement"] for each in (model, fitted.model)
    )
    assert complete == pytest.approx(1.0, abs=0.15)
    assert bare > 2.0
