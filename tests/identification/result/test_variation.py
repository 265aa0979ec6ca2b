"""Whether parameters vary from record to record."""

import dataclasses

import numpy as np
import pytest
from statsmodels.stats.meta_analysis import combine_effects

from identification.estimation.parameters import between_records
from identification.result.evidence import Disagreement
from identification.trajectory.fit import Fitted, fit
from identification.trajectory.start import problem_of
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def fits(example) -> tuple[Fitted, Fitted]:
    """The example shortened, fitted: as recorded, and with the clock of the drop test 0.5 % fast."""
    short = cropped(example, 3000, (0, 1, 2, 3))
    first, *others = short.records
    slower = dataclasses.replace(first, time=1.005 * first.time)
    return fit(problem_of(short)), fit(problem_of(dataclasses.replace(short, records=(slower, *others))))


def by_name(of: Fitted) -> dict[str, Disagreement]:
    return {one.name: one for one in between_records(of)}


def test_parameters_of_a_complete_model_are_the_same_in_all_records(fits):
    found = by_name(fits[0])
    assert {"k_i", "f_n"} <= set(found)
    assert min(one.chance for one in found.values()) > 1e-3
    common = fits[0].problem.values(fits[0].at)["f_n"]
    assert all(abs(value / common - 1.0) < 1e-2 for value, _ in found["f_n"].records.values())


def test_a_record_whose_clock_is_fast_has_a_natural_frequency_of_its_own(fits):
    found = by_name(fits[1])["f_n"]
    assert found.chance < 1e-4
    (drop, _), *others = (found.records[record.file] for record in fits[1].problem.experiment.records)
    assert drop < min(value for value, _ in others)


@pytest.mark.parametrize("values", [(1.0, 3.0), (1.0, 10.0), (0.1, 1.0, 1.0, 1.0)])
def test_scatter_is_that_of_the_values_where_errors_are_small(values):
    records = {f"{k}.csv": (value, 1e-6) for k, value in enumerate(values)}
    found = Disagreement(name="k_i", chi2=np.nan, degrees=len(values) - 1, chance=0.0, records=records)
    assert found.scatter == pytest.approx(np.std(values, ddof=1))


def test_what_one_record_alone_determines_does_not_scatter():
    records = {"a.csv": (1.0, 1e-9), "b.csv": (2.0, 1.0)}
    assert Disagreement(name="f_n", chi2=9.0, degrees=1, chance=1e-3, records=records).scatter == 0.0


def test_the_mean_over_records_is_that_of_statsmodels():
    """Random effects by the method of moments."""
    values, errors = np.array([1.0, 1.3, 0.8, 1.6]), np.array([0.1, 0.05, 0.2, 0.1])
    records = {f"{k}.csv": (float(value), float(error)) for k, (value, error) in enumerate(zip(values, errors, strict=True))}
    one = Disagreement(name="k_i", chi2=np.nan, degrees=3, chance=0.0, records=records)
    peer = combine_effects(values, errors**2, method_re="dl", use_t=False)
    assert one.scatter == pytest.approx(np.sqrt(peer.tau2))
    assert one.pooled == pytest.approx((peer.mean_effect_re, peer.sd_eff_w_re))
    assert one.document()["pooled"]["value"] == one.pooled[0]


def test_where_errors_explain_the_scatter_the_mean_has_the_error_of_all_together():
    records = {"a.csv": (1.0, 0.1), "b.csv": (1.05, 0.2)}
    one = Disagreement(name="k_i", chi2=0.05, degrees=1, chance=0.8, records=records)
    assert one.pooled[1] == pytest.approx((0.1**-2 + 0.2**-2) ** -0.5)


def test_what_a_record_estimates_alone_is_what_its_own_fit_gives(example, fits):
    """One step from the common fit, against a fit of one record to the end."""
    short, together = cropped(example, 3000, (0, 1, 2, 3)), by_name(fits[0])
    record = short.records[2]
    alone = fit(problem_of(dataclasses.replace(short, records=(record,))))
    assert alone.converged
    for name in ("k_i", "n", "lambda_i", "zeta", "f_n"):
        value, error = together[name].records[record.file]
        assert abs(value - alone.problem.values(alone.at)[name]) < 0.25 * error, name
