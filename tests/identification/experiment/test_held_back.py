"""Records that no fit may see, as experiment.toml declares them."""

import shutil

import pytest

from identification.experiment import ExperimentError, load_experiment
from vibrojax.data_files import data_path


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
