"""Whether parameters vary from record to record."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.calibration import ALPHA
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.result.between_records import Disagreement, disagreements
from identification.windows.prepare import prepare
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def fits(example) -> tuple[Fitted, Fitted]:
    """The example shortened, fitted: as recorded, and with the clock of the drop test 0.5 % fast."""

    def fit_of(experiment) -> Fitted:
        prepared = prepare(experiment)
        return fitted(first_point(prepared, prepared.start))

    short = cropped(example, 3000, (0, 1, 2, 3))
    first, *others = short.records
    slower = dataclasses.replace(first, time=1.005 * first.time)
    return fit_of(short), fit_of(dataclasses.replace(short, records=(slower, *others)))


def by_name(of: Fitted) -> dict[str, Disagreement]:
    return {one.name: one for one in disagreements(of)}


def test_parameters_of_a_complete_model_are_the_same_in_all_records(fits):
    found = by_name(fits[0])
    assert {"k_i", "f_n"} <= set(found)
    assert min(one.chance for one in found.values()) > 1e-3
    assert all(abs(value / fits[0].model.values()["f_n"] - 1.0) < 1e-2 for value, _ in found["f_n"].records.values())


def test_a_record_whose_clock_is_fast_has_a_natural_frequency_of_its_own(fits):
    found = by_name(fits[1])["f_n"]
    assert found.chance < ALPHA
    (drop, _), *others = (found.records[record.file] for record in fits[1].prepared.experiment.records)
    assert drop < min(value for value, _ in others)


@pytest.mark.parametrize("values", [(1.0, 3.0), (1.0, 10.0), (0.1, 1.0, 1.0, 1.0)])
def test_scatter_is_that_of_the_values_where_errors_are_small(values):
    records = {f"{k}.csv": (value, 1e-6) for k, value in enumerate(values)}
    found = Disagreement(name="k_i", chi2=np.nan, degrees=len(values) - 1, chance=0.0, records=records)
    assert found.scatter == pytest.approx(np.std(values, ddof=1))


def test_what_one_record_alone_determines_does_not_scatter():
    records = {"a.csv": (1.0, 1e-9), "b.csv": (2.0, 1.0)}
    assert Disagreement(name="f_n", chi2=9.0, degrees=1, chance=1e-3, records=records).scatter == 0.0
