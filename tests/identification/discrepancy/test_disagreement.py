"""Whether parameters hold still from record to record, and from the first half of a record to its second."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.disagreement import disagreements
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import fit
from identification.prepare import prepare
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def fits(example):
    """The example shortened, fitted: as recorded, with the drop test's clock 0.5 % fast, and by one that gets ever slower."""

    def fitted(experiment) -> Fitted:
        prepared = prepare(experiment)
        return Fitted(prepared=prepared, outcome=fit(prepared))

    short = cropped(example, 3000, (0, 1, 2, 3))
    first, *others = short.records
    slower = dataclasses.replace(first, time=1.005 * first.time)
    return (
        fitted(short),
        fitted(dataclasses.replace(short, records=(slower, *others))),
        fitted(dataclasses.replace(short, records=tuple(_ever_slower(record) for record in short.records[:1]))),
    )


def _ever_slower(record):
    """Read by a clock that loses 1 % of its rate in the course of the record."""
    elapsed = record.time - record.time[0]
    read = record.time[0] + elapsed * (1.0 - 0.005 * elapsed / elapsed[-1])
    return dataclasses.replace(record, channels={name: np.interp(read, record.time, values) for name, values in record.channels.items()})


def told(fitted, **options):
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in fitted.prepared.groups])
    return {one.name: one for one in disagreements(fitted, Tolerance(samples=samples, cut=1e9), **options)}


def test_parameters_of_a_complete_model_hold_still(fits):
    found = told(fits[0])
    assert {"k_i", "f_n"} <= set(found)
    assert min(one.chance for one in found.values()) > 1e-3
    assert all(abs(value / fits[0].model.values()["f_n"] - 1.0) < 1e-2 for value, _ in found["f_n"].records.values())


def test_a_record_whose_clock_is_fast_has_a_natural_frequency_of_its_own(fits):
    found = told(fits[1])["f_n"]
    assert found.chance < 1e-6
    (drop, _), *others = (found.records[record.file] for record in fits[1].prepared.experiment.records)
    assert drop < min(value for value, _ in others)


def test_a_spring_that_softens_in_the_course_of_a_record_differs_between_its_halves(fits):
    assert told(fits[2]) == {}, "one record has nothing to differ from"
    found, drop = told(fits[2], halves=True)["f_n"], fits[2].prepared.experiment.records[0].file
    (early, _), (late, _) = (found.records[f"the {half} half of {drop}"] for half in ("first", "second"))
    assert found.chance < 1e-6
    assert 0.003 < 1.0 - late / early < 0.01, "half of the change lies between the middles of the halves, all of it between their ends"
    assert min(one.chance for one in told(fits[0], halves=True).values()) > 1e-3
