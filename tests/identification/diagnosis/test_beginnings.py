"""The part of long and of many records that a diagnosis takes."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.beginnings import beginnings
from identification.experiment.experiment import Preparation
from identification.windows.windows import WindowLength

LEAST = 2 * WindowLength().longest


def repeated(record, samples, **changes):
    """A record of as many samples, repeated end to end."""
    times = -(-samples // len(record.time))
    step = record.time[1] - record.time[0]
    channels = {name: np.tile(values, times)[:samples] for name, values in record.channels.items()}
    time = record.time[0] + step * np.arange(samples)
    return dataclasses.replace(record, time=time, channels=channels, **changes)


@pytest.fixture
def experiment(example):
    """Two long records and a short one, cart records all."""
    _, cart, *_ = example.records
    records = (
        repeated(cart, 40_000, file="long.csv"),
        repeated(cart, 3_000, file="short.csv"),
        repeated(cart, 60_000, file="longer.csv"),
    )
    return dataclasses.replace(example, records=records)


def lengths(experiment):
    return {record.file: len(record.time) for record in experiment.records}


def test_short_records_are_whole_and_long_ones_share_the_rest(experiment):
    found, said = beginnings(experiment, 33e3)
    assert said == ("diagnosed in part, since they are long: long.csv, longer.csv; a part that `crop` chooses is taken whole",)
    assert lengths(found) == {"long.csv": 15_000, "short.csv": 3_000, "longer.csv": 15_000}
    for before, after in zip(experiment.records, found.records, strict=True):
        np.testing.assert_array_equal(after.time, before.time[: len(after.time)])
        for name, values in before.channels.items():
            np.testing.assert_array_equal(after.channels[name], values[: len(after.time)])
    step = experiment.records[0].time[1] - experiment.records[0].time[0]
    (notice,) = set(found.records[0].notices) - set(experiment.records[0].notices)
    assert notice == f"The first {14_999 * step:.4g} of {39_999 * step:.4g} s are diagnosed; a part that `crop` chooses is taken whole."
    assert found.records[1].notices == experiment.records[1].notices


def test_all_is_taken_where_there_is_not_too_much(experiment):
    """A held-back record may be the longest."""
    held = dataclasses.replace(repeated(experiment.records[0], 90_000), file="held.csv", held_back=True)
    experiment = dataclasses.replace(experiment, records=(*experiment.records, held))
    found, said = beginnings(experiment, 2e5)
    assert lengths(found) == lengths(experiment)
    assert said == ()


def test_each_record_keeps_two_windows(experiment):
    long, short, longer = experiment.records
    cropped = dataclasses.replace(long, preparation=Preparation(crop=(0.0, 10.0)))
    found, _ = beginnings(dataclasses.replace(experiment, records=(cropped, short, longer)), 41e3)
    assert lengths(found) == {"long.csv": 40_000, "short.csv": LEAST, "longer.csv": LEAST}


def test_held_back_records_stay_whole_beside_cropped_ones(experiment):
    cropped = tuple(dataclasses.replace(one, preparation=Preparation(crop=(0.0, 20.0))) for one in experiment.records)
    held = dataclasses.replace(experiment.records[0], file="held.csv", held_back=True)
    found, said = beginnings(dataclasses.replace(experiment, records=(*cropped, held)), 2e5)
    assert lengths(found)["held.csv"] == 40_000
    assert said == ()


def test_cropped_records_are_whole_and_held_back_ones_are_cut_alike(experiment):
    long, short, longer = experiment.records
    cropped = dataclasses.replace(long, preparation=Preparation(crop=(0.0, 10.0)))
    held = dataclasses.replace(long, file="held.csv", held_back=True)
    found, _ = beginnings(dataclasses.replace(experiment, records=(cropped, short, longer, held)), 53e3)
    assert lengths(found) == {"long.csv": 40_000, "short.csv": 3_000, "longer.csv": 10_000, "held.csv": 10_000}


def test_of_many_records_some_of_each_kind_are_taken(example):
    drop, cart, *_ = example.records
    records = [dataclasses.replace(one, file=f"{kind}{k}.csv") for kind, one in (("drop", drop), ("cart", cart)) for k in range(50)]
    found, said = beginnings(dataclasses.replace(example, records=tuple(records)), 10.0 * LEAST)
    kinds = [record.kind for record in found.records]
    assert (kinds.count("drop-test"), kinds.count("cart-excitation")) == (5, 5)
    assert said[0] == "10 of 100 records are diagnosed, spread evenly over each kind"


def test_what_comes_before_the_release_is_left_out_first(example):
    """A long hold would else be all that is taken."""
    drop = example.records[0]
    hold, step = 30_000, drop.time[1] - drop.time[0]
    rng = np.random.default_rng(0)
    channels = {}
    for name, values in drop.channels.items():
        still = values[0] if name == "hammer_displacement" else 0.0
        channels[name] = np.concatenate([still + drop.noise[name] * rng.normal(size=hold), values])
    time = drop.time[0] + step * np.arange(hold + len(drop.time))
    held = dataclasses.replace(drop, time=time, channels=channels)
    (found,) = beginnings(dataclasses.replace(example, records=(held,)), 5e3)[0].records
    assert found.time[0] == pytest.approx(time[hold], abs=0.02)
    assert len(found.time) <= 5_000
