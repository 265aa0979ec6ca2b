"""Whether parameters hold still in the course of a record."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.drift import drifts
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import fit
from identification.prepare import prepare
from tests.identification.conftest import cropped


def fitted(experiment) -> Fitted:
    prepared = prepare(experiment)
    return Fitted(prepared=prepared, outcome=fit(prepared))


def told(fitted):
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in fitted.prepared.groups])
    return {one.name: one for one in drifts(fitted, Tolerance(samples=samples, cut=1e9))}


def read_at(record, time):
    return dataclasses.replace(record, channels={name: np.interp(time, record.time, values) for name, values in record.channels.items()})


def ever_slower(record):
    """Read by a clock that loses 1 % of its rate in the course of the record."""
    elapsed = record.time - record.time[0]
    return read_at(record, record.time[0] + elapsed * (1.0 - 0.005 * elapsed / elapsed[-1]))


def slower(record):
    """Read by a clock that is 0.5 % slow throughout."""
    return read_at(record, record.time[0] + 0.995 * (record.time - record.time[0]))


@pytest.fixture(scope="module")
def short(example):
    return cropped(example, 3000, (0, 1, 2, 3))


def test_parameters_of_a_complete_model_hold_still(short):
    found = told(fitted(short))
    assert {"k_i", "f_n"} <= set(found)
    assert min(one.chance for one in found.values()) > 1e-3


def test_a_spring_that_softens_in_the_course_of_a_record_differs_between_its_halves(short):
    drop, *_ = short.records
    found = told(fitted(dataclasses.replace(short, records=(ever_slower(drop),))))["f_n"]
    ((early, _), (late, _)) = found.halves[found.surest]
    assert (found.surest, list(found.halves)) == (drop.file, [drop.file])
    assert found.chance < 1e-6
    assert found.gain > 100.0
    assert 0.003 < 1.0 - late / early < 0.01, "half of the change lies between the middles of the halves, all of it between their ends"
    assert found.change == pytest.approx(np.log(early / late), rel=0.02), "in the logarithm"


def test_a_spring_that_differs_only_between_records_does_not_drift(short):
    drop, *others = short.records
    found = told(fitted(dataclasses.replace(short, records=(slower(drop), *others))))["f_n"]
    assert found.chance > 1e-6
