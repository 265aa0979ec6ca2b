"""Parameters that vary between records: what a score test says of each, against fits in which it varies."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from statsmodels.regression.mixed_linear_model import MixedLM

from identification.experiment import Experiment
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.likelihood.joint import point
from identification.likelihood.random_effects import variation_std, variations, with_variation
from identification.windows.declared_model import nominal_model
from identification.windows.prepare import prepare
from identification.windows.simulate import simulate_record
from tests.identification.conftest import TRUTH, cropped


def simulated(experiment: Experiment, stiffness: dict[int, float]) -> Fitted:
    """The example shortened and simulated, fitted; the contact stiffness of some records, by their number, differs by a factor."""
    rng, records = np.random.default_rng(0), []
    model = nominal_model(experiment, None).replace(TRUTH)
    for index, record in enumerate(experiment.records):
        readings = simulate_record(model.replace({"k_i": TRUTH["k_i"] * stiffness.get(index, 1.0)}), record)
        channels = {name: readings[name] + record.noise[name] * rng.normal(size=len(record.time)) for name in record.channels}
        records.append(dataclasses.replace(record, channels=channels))
    prepared = prepare(dataclasses.replace(experiment, records=tuple(records)))
    return fitted(first_point(prepared, prepared.start))


@pytest.fixture(scope="module")
def fits(example) -> tuple[Fitted, Fitted]:
    """With the same contact stiffness in all records, and with two that differ by 1 % from the rest."""
    short = cropped(example, 3000, (0, 1, 2, 3))
    return simulated(short, {}), simulated(short, {2: 1.01, 3: 0.99})


@pytest.mark.thorough
def test_nothing_varies_where_the_rig_is_the_same_in_all_records(fits):
    found = variations(fits[0])
    assert {one.name for one in found} == {"k_i", "n", "lambda_i", "zeta", "f_n"}
    assert min(one.chance for one in found) > 1e-3
    assert [one.chance for one in found] == sorted(one.chance for one in found)


@pytest.mark.thorough
def test_what_is_expected_of_a_variation_is_about_what_its_fit_gains(fits):
    """k_i and n, strongly correlated within each record, do not hide each other."""
    model = fits[1]
    one = variations(model)[0]
    assert one.name == "k_i"
    assert one.chance < 1e-9
    assert 0.003 < one.std < 0.03
    prepared = with_variation(model, one)
    varied = fitted(point(prepared, prepared.start, model.variances), rounds=3, measure_noise=False)
    assert 0.5 * one.chi2 < 2.0 * (varied.log_likelihood - model.log_likelihood) < 2.0 * one.chi2
    assert one.name not in {other.name for other in variations(varied)}


def test_standard_deviation_is_that_of_greatest_restricted_likelihood():
    """Three records' own values of one parameter: its mean is integrated out by a wide prior."""
    values, errors = np.array([-1.0, 0.3, 1.2]), np.array([0.1, 0.4, 0.2])
    weight = np.diag(errors**-2.0)
    information = weight - weight.sum(axis=1, keepdims=True) @ weight.sum(axis=0, keepdims=True) / weight.sum()
    known, directions = np.linalg.eigh(information)
    known, directions = known[1:], directions[:, 1:]

    def log_likelihood(std):
        return multivariate_normal(np.zeros(3), np.diag(errors**2 + std**2) + 1e6).logpdf(values)

    trials = np.linspace(0.5, 2.0, 3001)
    expected = trials[np.argmax([log_likelihood(std) for std in trials])]
    assert variation_std(directions.T @ information @ values, known) == pytest.approx(expected, abs=1e-3)


def test_standard_deviation_is_that_of_a_linear_mixed_model_by_statsmodels():
    """Six records with forty samples each of one constant, which varies between them."""
    rng, records, samples = np.random.default_rng(3), 6, 40
    readings = 2.0 + np.repeat(rng.normal(0.0, 0.5, records), samples) + rng.normal(0.0, 1.0, records * samples)
    mixed = MixedLM(readings, np.ones((records * samples, 1)), groups=np.repeat(np.arange(records), samples)).fit(reml=True)
    information = samples / mixed.scale * (np.eye(records) - 1.0 / records)
    known, directions = (part[..., 1:] for part in np.linalg.eigh(information))
    score = directions.T @ information @ readings.reshape(records, samples).mean(axis=1)
    assert variation_std(score, known) == pytest.approx(float(np.sqrt(mixed.cov_re[0, 0])), rel=1e-3)


@pytest.mark.parametrize("score", [[0.0, 0.0], [0.5, -0.5]])
def test_there_is_none_where_errors_explain_the_scatter(score):
    assert variation_std(np.array(score), np.ones(2)) == 0.0
