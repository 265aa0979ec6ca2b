"""Gaps that the recorded motion shows to be slips, and those that it leaves open."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.experiment import Experiment, ExperimentError, Record, Sensor
from identification.guesses.declared_model import check_clearance
from vibrojax.contact import HuntCrossley, NoContact

TIME = np.arange(200) / 1000.0
SWING = 2e-3 * np.sin(60.0 * TIME)
STOP = HuntCrossley(1e6, 1.5, 0.3)
FAR_OFF = -1.0


def record(kind: str = "drop-test", gap: float = FAR_OFF, **channels: np.ndarray) -> Record:
    """A hammer that swings by 4 mm, far inside the stop if nothing else is said."""
    return Record(file="one.csv", kind=kind, gap=gap, time=TIME, channels=channels or {"hammer_displacement": SWING})


def refusal(example: Experiment, one: Record, law=STOP, zero: float | None = None) -> str:
    """What is said of a record beside sound ones; empty where nothing is."""
    sensors = {"hammer_displacement": Sensor(unit="m", zero=zero)}
    try:
        check_clearance(dataclasses.replace(example, records=(*example.records, one), sensors=sensors), law)
    except ExperimentError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "one",
    [
        record(),
        record(relative_displacement=np.where(TIME > 0.1, np.nan, SWING)),
        record("cart-excitation", hammer_displacement=SWING + 0.2 * TIME, cart_displacement=0.2 * TIME),
        dataclasses.replace(record(), held_back=True),
    ],
    ids=["cart at rest", "samples missing", "cart moving", "held back"],
)
def test_a_hammer_inside_the_stop_all_the_time_is_refused(example, one):
    assert refusal(example, one).startswith("gap of record 'one.csv' is -1 m, and its hammer stays between -0.00")


def test_any_fit_asks_before_it_begins(example):
    wrong = dataclasses.replace(example, records=(*example.records[:-1], dataclasses.replace(example.records[-1], gap=FAR_OFF)))
    with pytest.raises(ExperimentError, match=r"is -1 m, and its hammer stays between"):
        fit_experiment(wrong)


@pytest.mark.parametrize(
    ("one", "more"),
    [
        (record(gap=-5e-3), {}),
        (record(gap=-5e-5, hammer_displacement=1e-3 * SWING), {}),
        (record(gap=0.0, hammer_displacement=np.full(200, 1e-6)), {}),
        (record(gap=1.0), {}),
        (record(), {"law": NoContact()}),
        (record(), {"zero": 2.0}),
        (record("free-decay"), {}),
        (record("cart-excitation"), {}),
        (record(hammer_acceleration=SWING), {}),
    ],
    ids=["pressed", "preloaded", "dead channel", "out of reach", "no stop", "unknown zero", "no contact", "cart unseen", "no displacement"],
)
def test_a_gap_that_a_record_cannot_contradict_is_accepted(example, one, more):
    assert refusal(example, one, **more) == ""
