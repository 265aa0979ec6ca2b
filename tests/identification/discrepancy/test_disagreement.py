"""Whether parameters hold still from record to record."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.diagnosis import Disagreement
from identification.discrepancy.disagreement import disagreements
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import fit
from identification.prepare import prepare
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def fits(example):
    """The example shortened, fitted: as recorded, and with the clock of the drop test 0.5 % fast."""

    def fitted(experiment) -> Fitted:
        prepared = prepare(experiment)
        return Fitted(prepared=prepared, outcome=fit(prepared))

    short = cropped(example, 3000, (0, 1, 2, 3))
    first, *others = short.records
    slower = dataclasses.replace(first, time=1.005 * first.time)
    return fitted(short), fitted(dataclasses.replace(short, records=(slower, *others)))


def told(fitted):
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in fitted.prepared.groups])
    return {one.name: one for one in disagreements(fitted, Tolerance(samples=samples, cut=1e9))}


def test_parameters_of_a_complete_model_hold_still(fits):
    found = told(fits[0])
    assert {"k_i", "f_n"} <= set(found)
    assert min(one.chance for one in found.values()) > 1e-3
    assert all(abs(value / fits[0].model.values()["f_n"] - 1.0) < 1e-2 for value, _ in found["f_n"].records.values())


@pytest.mark.parametrize("values", [(1.0, 3.0), (1.0, 10.0), (0.1, 1.0, 1.0, 1.0)])
def test_scatter_is_that_of_the_values_where_errors_are_small(values):
    records = {f"{k}.csv": (value, 1e-6) for k, value in enumerate(values)}
    found = Disagreement(name="k_i", chi2=np.nan, degrees=len(values) - 1, chance=0.0, records=records)
    assert found.scatter == pytest.approx(np.std(values, ddof=1))


def test_a_record_whose_clock_is_fast_has_a_natural_frequency_of_its_own(fits):
    found = told(fits[1])["f_n"]
    assert found.chance < 1e-6
    (drop, _), *others = (found.records[record.file] for record in fits[1].prepared.experiment.records)
    assert drop < min(value for value, _ in others)


def test_what_one_record_alone_tells_does_not_scatter():
    records = {"a.csv": (1.0, 1e-9), "b.csv": (2.0, 1.0)}
    assert Disagreement(name="f_n", chi2=9.0, degrees=1, chance=1e-3, records=records).scatter == 0.0
