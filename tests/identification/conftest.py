"""A small experiment of known truth for the tests of the fit."""

import dataclasses

import pytest

from identification.experiment import Experiment, load_experiment
from tests.quick_compiling import quick_compiling as quick_compiling
from vibrojax.data_files import data_path

TRUTH = {"k_i": 3.0e6, "n": 1.5, "lambda_i": 0.35, "zeta": 0.012, "f_n": 5.2}
"""Of the embedded example, as its README states; its records were made by a simulator that shares no code with the program."""


def cropped(experiment: Experiment, samples: int, files: tuple[int, ...]) -> Experiment:
    """Some records of an experiment, shortened."""
    records = tuple(
        dataclasses.replace(r, time=r.time[:samples], channels={name: values[:samples] for name, values in r.channels.items()})
        for r in (experiment.records[i] for i in files)
    )
    return dataclasses.replace(experiment, records=records)


@pytest.fixture(scope="session")
def example() -> Experiment:
    """The embedded example, whole."""
    return load_experiment(data_path("example"))


@pytest.fixture(scope="session")
def small(example) -> Experiment:
    """Half a second of its drop test and of one cart record."""
    return cropped(example, 2000, (0, 1))


@pytest.fixture(scope="session")
def truth() -> dict[str, float]:
    """True parameters of `example` and `small`."""
    return TRUTH
