"""Parameters that differ between records: found, weighed, and given up once records no longer say otherwise."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from identification.diagnosis.left_out import left_out
from identification.diagnosis.scatter import _with_scatter, contradicted, gain_of_values, if_still_needed, with_values
from identification.estimation.parameters import variations
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted, fit
from identification.trajectory.remodel import with_variation
from identification.trajectory.start import problem_of
from identification.trajectory.variances import LARGEST_FORCE
from tests.identification.trajectory.conftest import shaken

RATES = 1.0 + 0.01 * np.array([1.2, -0.7, -1.5, 0.9, -0.4, 0.5])


def silent(line: str) -> None:
    pass


def decays(rates: np.ndarray) -> Fitted:
    """Free decays of one rig, of which the clock runs at another rate in each record."""
    experiment = shaken(len(rates))
    records = [dataclasses.replace(one, time=one.time / rate) for one, rate in zip(experiment.records, rates, strict=True)]
    return fit(problem_of(dataclasses.replace(experiment, records=tuple(records))))


@pytest.fixture(scope="module")
def scattered() -> Fitted:
    return decays(RATES)


@pytest.fixture(scope="module")
def steady() -> Fitted:
    return decays(np.ones(6))


def test_a_frequency_that_differs_gets_a_value_in_each_record(scattered):
    names = contradicted(scattered)
    assert names == ("f_n", "zeta"), "records hardly tell one from another, and which it is is for the likelihood to say"
    found = with_values(scattered, names, silent)
    assert [*variations(found.problem)] == ["f_n"] and contradicted(found) == ()
    place = found.problem.unknowns.own.index("variation.f_n")
    np.testing.assert_allclose(found.at.own[:, place], np.log(RATES / RATES.mean()), atol=3e-3)


def test_a_record_left_out_is_predicted_without_a_value_of_its_own(scattered):
    """Where records differ by nothing else, its error is no smaller than with a common value."""
    found = with_values(scattered, ("f_n",), silent)
    assert left_out(found, found.problem.experiment).error > 0.5 * left_out(scattered, scattered.problem.experiment).error


def test_what_values_gain_at_first_order_is_more_than_chance_where_they_differ_alone(scattered, steady):
    gain, degrees = gain_of_values(scattered, ("f_n",))
    assert degrees == 1 and chance(gain, degrees, 1) < 1e-6
    assert chance(*gain_of_values(steady, ("f_n",)), 1) > 1e-3


def test_only_the_parameter_that_differs_is_charged(scattered):
    alone, both = gain_of_values(scattered, ("f_n",)), gain_of_values(scattered, ("zeta", "f_n"))
    assert both[1] == 1 and both[0] == pytest.approx(alone[0], rel=0.05)


def test_a_record_that_says_nothing_of_a_parameter_may_be_the_first(scattered):
    experiment = scattered.problem.experiment
    channels = {name: np.zeros_like(values) for name, values in experiment.records[0].channels.items()}
    still = dataclasses.replace(experiment.records[0], channels=channels, file="still.csv")
    orders = ((still, *experiment.records), (*experiment.records, still))
    found = [gain_of_values(fit(problem_of(dataclasses.replace(experiment, records=one))), ("f_n", "zeta")) for one in orders]
    assert found[0] == pytest.approx(found[1], rel=0.01)
    assert found[0][0] > 30.0 and found[0][1] == 1


def test_deviations_have_the_likelihood_of_normal_ones(scattered):
    """Differences of independent normal values from the one of another record; the second parameter does not deviate."""
    rng, of = np.random.default_rng(3), np.array(["f_n", "f_n", "f_n", "zeta"])
    root = 0.01 * rng.standard_normal((4, 4))
    values, covariance = rng.normal(0.0, 0.05, 4), root @ root.T + 1e-4 * np.eye(4)
    found = Reestimated(deviance=7.0, strengths=values, covariance=covariance, variances=scattered.variances, at=scattered.at)
    scatter = np.zeros((4, 4))
    scatter[:3, :3] = 1.0 + np.eye(3)

    def expected(std: float) -> float:
        density = multivariate_normal(np.zeros(4), covariance + std**2 * scatter).logpdf(values)
        return 7.0 - 2.0 * (density - multivariate_normal(values, covariance).logpdf(values))

    assert _with_scatter(found, of, ("f_n",)) == pytest.approx(min(map(expected, np.geomspace(1e-3, 1.0, 2000))), abs=1e-3)


def test_records_of_one_rig_contradict_each_other_in_nothing(steady):
    assert not contradicted(steady) and not variations(steady.problem)
    assert with_values(steady, ("f_n",), silent) is None


def test_beside_a_force_at_its_limit_physics_is_missing_and_records_are_not_compared(scattered):
    largest = LARGEST_FORCE * scattered.problem.scales.force
    variances = dataclasses.replace(scattered.variances, force=dataclasses.replace(scattered.variances.force, std=largest))
    assert contradicted(dataclasses.replace(scattered, variances=variances)) == ()


def test_values_go_where_records_no_longer_differ(scattered, steady):
    found = with_values(scattered, ("f_n",), silent)
    assert [*variations(if_still_needed(found, silent).problem)] == ["f_n"]
    allowed = fit(with_variation(steady.problem, {"f_n": 1e-3}))
    assert [*variations(allowed.problem)] == ["f_n"]
    assert not variations(if_still_needed(allowed, silent).problem)
