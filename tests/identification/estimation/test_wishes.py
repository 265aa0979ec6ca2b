"""Start, bounds, prior and variation between records, as the operator wants them for single parameters."""

import dataclasses

import numpy as np
import pytest

from benchmarks.smoothed_fit.rig import NOISE
from identification.estimation.estimate import fit_experiment
from identification.estimation.simulate import simulate_record
from identification.experiment import Experiment, ExperimentError, ParameterOption
from identification.experiment.experiment import Prior
from identification.report.tables import parameters, wishes
from identification.result.files import fit_json
from identification.result.result import AT_BOUND, OK
from identification.trajectory.start import problem_of
from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Linear


def wishing(experiment: Experiment, **options: ParameterOption) -> Experiment:
    return dataclasses.replace(experiment, parameters=options)


@pytest.fixture(scope="module")
def plain(small):
    return {p.spec.name: p for p in fit_experiment(small).parameters}


@pytest.mark.thorough
def test_a_prior_moves_the_estimate_as_information_adds_up(small, plain):
    """One as wide as the records' own standard error, two of these away: half way, with an error less by the root of two."""
    own = plain["f_n"]
    prior = Prior(mean=own.value + 2.0 * own.stderr, std=own.stderr)
    result = fit_experiment(wishing(small, f_n=ParameterOption(prior=prior)))
    found = {p.spec.name: p for p in result.parameters}["f_n"]
    assert found.value == pytest.approx(own.value + own.stderr, abs=0.1 * own.stderr)
    assert found.stderr == pytest.approx(own.stderr / np.sqrt(2.0), rel=0.03)
    assert next(row[6] for row in parameters(result).rows if row[0] == "f_n") == "ok, prior"
    assert fit_json(result)["parameters"]["f_n"]["prior"] == {"mean": prior.mean, "std": prior.std}


def test_a_prior_identifies_what_the_records_do_not(example):
    """Without contact nothing else says anything of the stop."""
    drop = example.records[0]
    quiet = {name: values[:150] for name, values in drop.channels.items()}
    record = dataclasses.replace(drop, time=drop.time[:150], channels=quiet)
    prior = Prior(mean=2e6, std=2e5)
    result = fit_experiment(dataclasses.replace(example, records=(record,), parameters={"k_i": ParameterOption(prior=prior)}))
    found = {p.spec.name: p for p in result.parameters}["k_i"]
    assert found.status == OK
    assert (found.value, found.stderr) == (pytest.approx(2e6, rel=1e-3), pytest.approx(2e5, rel=1e-2))


def test_an_estimate_stops_at_its_bound_and_says_so(small, plain):
    low = plain["n"].value + 20.0 * plain["n"].stderr
    result = fit_experiment(wishing(small, n=ParameterOption(bounds=(low, 2.0))))
    found = {p.spec.name: p for p in result.parameters}["n"]
    assert (found.status, found.value) == (AT_BOUND, low)
    assert ("n", f"bounds {low:g} … 2") in wishes(result)


@pytest.mark.thorough
def test_bounds_that_do_not_bind_change_nothing(small, plain):
    result = fit_experiment(wishing(small, k_i=ParameterOption(bounds=(1e5, 1e8))))
    for one in result.parameters:
        assert one.value == pytest.approx(plain[one.spec.name].value, abs=0.05 * one.stderr)
        assert one.stderr == pytest.approx(plain[one.spec.name].stderr, rel=1e-2)


def test_a_first_guess_outside_the_bounds_starts_at_them(small):
    problem = problem_of(wishing(small, k_i=ParameterOption(bounds=(1e4, 1e5))))
    assert problem.values(problem.start)["k_i"] == pytest.approx(1e5)


@pytest.fixture(scope="module")
def scattered(example):
    """Six drop tests on a suspension whose frequency differs from one to the next by one per cent."""
    draws, drop = np.random.default_rng(3), example.records[0]
    frequencies = 5.0 * (1.0 + 0.01 * np.array([-1.2, -0.7, 0.1, 0.4, 0.6, 1.3]))
    records = []
    for number, f_n in enumerate(frequencies):
        model = Model(mass=0.5, suspension=Linear(0.02, float(f_n)), law=HuntCrossley(1e6, 1.5, 0.3))
        time = 2.5e-4 * np.arange(1200)
        record = dataclasses.replace(
            drop, file=f"drop{number}.csv", time=time, gap=0.0, initial_displacement=-3e-3, initial_velocity=0.0, channels={}, noise={}
        )
        motion = simulate_record(model, record)
        channels = {name: motion[name] + NOISE[name] * draws.standard_normal(len(time)) for name in ("hammer_displacement", "impact_force")}
        records.append(dataclasses.replace(record, channels=channels, noise={name: NOISE[name] for name in channels}))
    sensors = {name: dataclasses.replace(example.sensors["impact_force"], noise=NOISE[name]) for name in records[0].channels}
    return dataclasses.replace(example, records=tuple(records), sensors=sensors, mass=0.5), frequencies


def test_a_parameter_that_may_vary_has_a_value_for_each_record(scattered):
    experiment, frequencies = scattered
    result = fit_experiment(wishing(experiment, f_n=ParameterOption(varies=True)))
    found = {p.spec.name: p for p in result.parameters}["f_n"]
    spread = float(np.std(frequencies, ddof=1))
    assert found.between == pytest.approx(spread, rel=0.1)
    assert found.value == pytest.approx(float(np.mean(frequencies)), abs=0.2 * spread)
    assert found.stderr == pytest.approx(spread / np.sqrt(len(frequencies)), rel=0.1)
    assert result.chi2_reduced == pytest.approx(1.0, abs=0.05)
    own = [next(n.value for n in record.nuisances if n.name == "variation.f_n") for record in result.records]
    np.testing.assert_allclose(found.value * np.exp(own), frequencies, rtol=5e-4)
    assert result.unrest is None  # a common frequency would leave a random force
    true = {"k_i": 1e6, "n": 1.5, "lambda_i": 0.3, "zeta": 0.02}
    for name, value in true.items():
        one = next(p for p in result.parameters if p.spec.name == name)
        assert abs(one.value - value) < 3.0 * one.stderr < 0.5 * value, name
    assert next(row[6] for row in parameters(result).rows if row[0] == "f_n") == "ok, varies"
    assert fit_json(result)["parameters"]["f_n"]["std_between_records"] == found.between


@pytest.mark.thorough
def test_of_two_parameters_that_may_vary_each_is_estimated_beside_the_other(scattered):
    """Alone, the damping would vary in place of the frequency; its order among the two does not matter."""
    experiment, frequencies = scattered
    varies = ParameterOption(varies=True)
    found = [
        {p.spec.name: p for p in fit_experiment(wishing(experiment, **{name: varies for name in names})).parameters}
        for names in (("zeta", "f_n"), ("f_n", "zeta"))
    ]
    for one in found:
        assert one["f_n"].between == pytest.approx(float(np.std(frequencies, ddof=1)), rel=0.1)
        assert one["zeta"].between < 3.0 * one["zeta"].stderr
    assert found[0]["zeta"].between == pytest.approx(found[1]["zeta"].between, abs=0.1 * found[0]["zeta"].stderr)


def test_a_parameter_that_may_vary_and_does_not_stays_common(small, plain):
    result = fit_experiment(wishing(small, f_n=ParameterOption(varies=True)))
    found = {p.spec.name: p for p in result.parameters}["f_n"]
    assert found.between == pytest.approx(0.0, abs=0.1 * plain["f_n"].stderr)
    for one in result.parameters:
        assert one.value == pytest.approx(plain[one.spec.name].value, abs=0.05 * plain[one.spec.name].stderr)
        assert one.stderr == pytest.approx(plain[one.spec.name].stderr, rel=1e-2)


@pytest.mark.parametrize(
    ("name", "option", "message"),
    [
        ("ki", ParameterOption(start=1e6), r"unknown parameter 'ki' in \[parameters\]: did you mean 'k_i'\?"),
        ("zeta", ParameterOption(bounds=(0.0, 0.1)), r"bounds in \[parameters.zeta\] reach to 0: expected a number above 0"),
        ("n", ParameterOption(bounds=(-1.0, 2.0)), r"bounds in \[parameters.n\] reach to -1: expected a number above 0"),
        (
            "n",
            ParameterOption(prior=Prior(mean=9.0, std=1.0)),
            r"mean of the prior of n in \[parameters\] is 9: expected 0.8 to 4; correct it",
        ),
    ],
)
def test_a_wish_that_the_model_cannot_fulfil_is_refused(small, name, option, message):
    with pytest.raises(ExperimentError, match=message):
        problem_of(wishing(small, **{name: option}))


def test_nothing_varies_between_the_records_of_one(small):
    with pytest.raises(ExperimentError, match=r"\[parameters.n\] varies between records, and one is fitted: expected two or more"):
        problem_of(dataclasses.replace(wishing(small, n=ParameterOption(varies=True)), records=small.records[:1]))
