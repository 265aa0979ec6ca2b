"""The whole fit: recovery, control, verdicts."""

import dataclasses
import json
import math

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.estimation.parameters import unrest
from identification.estimation.simulate import simulate_record
from identification.experiment import ParameterOption, load_experiment
from identification.report import tables
from identification.result.files import fit_json
from identification.result.result import FIXED, NOT_IDENTIFIABLE, OK
from identification.trajectory import elimination
from identification.trajectory.chain_equations import Weighed
from identification.trajectory.fit import fit
from identification.trajectory.motion import Estimate
from identification.trajectory.random_force import RandomForce
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.variances import vanishes
from tests.identification.conftest import TRUTH, cropped
from tests.identification.trajectory.conftest import F_N, FORCE, MEMORY, ZETA, shaken

COMPLETE = ("case-03", "case-05", "case-16")


@pytest.fixture(scope="module")
def fitted(example):
    """The embedded example, fitted as `fit-parameters` does."""
    return fit_experiment(example)


def test_example_is_recovered(fitted, truth):
    """Every parameter within three standard errors, and within 2 %; no misfit; no warning."""
    assert fitted.converged
    assert fitted.warnings == ()
    assert fitted.unrest is None and fitted.force_share == 0.0
    assert set(fitted.reading_error) == set(fitted.experiment.records[0].channels)
    assert all(one.over_noise == pytest.approx(1.0, abs=0.03) and one.order == 0 for one in fitted.reading_error.values())
    assert 0.98 < fitted.chi2_reduced < 1.02
    for parameter in fitted.parameters:
        true = truth[parameter.spec.name]
        assert parameter.status == OK
        assert abs(parameter.value - true) < 3 * parameter.stderr
        assert parameter.value == pytest.approx(true, rel=0.02)
        assert parameter.ci95[0] < parameter.value < parameter.ci95[1]


def test_discretisation_is_a_tenth_of_the_errors(fitted):
    """Halving all steps moves no parameter by a tenth of its standard error."""
    assert fitted.discretisation < 0.1


def test_stiffness_and_damping_follow(fitted, example):
    """k = m omega_n^2 and c = 2 zeta omega_n m."""
    values = {p.spec.name: p.value for p in fitted.parameters}
    derived = {d.name: d for d in fitted.derived}
    omega = 2 * math.pi * values["f_n"]
    assert derived["k"].value == pytest.approx(example.mass * omega**2)
    assert derived["c"].value == pytest.approx(2 * values["zeta"] * omega * example.mass)
    assert 0 < derived["k"].stderr < 1e-3 * derived["k"].value


def test_every_record_alone_agrees_where_the_rig_is_the_same_in_all(fitted):
    """The means of the records' own estimates are those of all together, and none scatters more than its errors."""
    together = {p.spec.name: p for p in fitted.parameters}
    for one in fitted.between_records:
        assert len(one.records) == 4
        assert one.chance > 1e-3
        assert one.pooled[0] == pytest.approx(together[one.name].value, abs=3.0 * one.pooled[1])


def test_an_unidentifiable_mass_leaves_the_stiffness_without_an_error(small):
    """A motion without forces determines the natural frequency, and the mass not at all."""
    drop, _ = small.records
    scores = dataclasses.replace(drop, channels={"hammer_displacement": drop.channels["hammer_displacement"]})
    found = fit_experiment(dataclasses.replace(small, records=(scores,), mass_is_known=False))
    status = {p.spec.name: p.status for p in found.parameters}
    assert (status["m"], status["f_n"]) == (NOT_IDENTIFIABLE, OK)
    assert [d.stderr for d in found.derived] == [None, None]


def test_records_stand_beside_their_predictions(fitted, example):
    """Residuals of every channel are at the noise, and every sample has a prediction."""
    for shown, record in zip(fitted.records, example.records, strict=True):
        assert shown.samples == len(record.time)
        for name in record.channels:
            residual = (shown.measured[name] - shown.predicted[name]) / shown.noise[name]
            assert residual.shape == record.time.shape
            assert np.std(residual) == pytest.approx(1.0, abs=0.05)


def test_contact_parameters_are_not_identifiable_without_contact(example):
    """A record without impacts says nothing of the stop, and the fit says so; the suspension is found all the same."""
    quiet = cropped(example, 150, (0,))
    result = fit_experiment(quiet)
    status = {p.spec.name: p for p in result.parameters}
    for name in ("k_i", "n", "lambda_i"):
        assert status[name].status == NOT_IDENTIFIABLE
        assert status[name].stderr is None
        assert "does not touch" in status[name].reason
    assert status["f_n"].stderr is not None and abs(status["f_n"].value - TRUTH["f_n"]) < 4.0 * status["f_n"].stderr


def test_a_fixed_parameter_stays(small):
    """`fixed` holds the start; the others are still estimated."""
    held = dataclasses.replace(small, parameters={"n": ParameterOption(start=1.45, fixed=True)})
    result = fit_experiment(held)
    rows = {p.spec.name: p for p in result.parameters}
    assert rows["n"].value == 1.45
    assert rows["n"].status == FIXED
    assert rows["k_i"].stderr > 0


def test_states_are_fitted_though_all_parameters_are_held(small, truth):
    free_flight = dataclasses.replace(small.records[0], kind="free-decay", gap=1.0)
    channels = {"hammer_displacement": free_flight.channels["hammer_displacement"][:180]}
    record = dataclasses.replace(free_flight, time=free_flight.time[:180], channels=channels)
    held = {name: ParameterOption(start=value, fixed=True) for name, value in truth.items()}
    result = fit_experiment(dataclasses.replace(small, records=(record,), parameters=held))
    assert result.converged
    assert result.chi2_reduced == pytest.approx(1.0, abs=0.35)


def test_a_shaken_rig_has_a_random_force_with_errors():
    """Size and memory within three standard errors; the free motion misfits, and the force is the reason."""
    found = fit_experiment(shaken(3))
    assert found.unrest is not None
    for (value, stderr), truth in ((found.unrest.force_rms, FORCE), (found.unrest.memory, MEMORY)):
        assert abs(value - truth) < 3.0 * stderr and stderr < truth
    for parameter, truth in zip(found.parameters, (ZETA, F_N), strict=True):
        assert abs(parameter.value - truth) < 3.0 * parameter.stderr
    assert found.chi2_reduced > 10.0 and found.force_share > 0.9
    assert found.reading_error["hammer_displacement"].over_noise == pytest.approx(1.0, abs=0.15)
    document = fit_json(found)
    assert document["unrest"]["force_rms"]["stderr"] == found.unrest.force_rms[1]
    assert set(document["reading_error"]["hammer_displacement"]) >= {"rms", "unit", "order"}
    assert tables.shares(found.reading_error, found.unrest, found.force_share).startswith("Of the squared misfit 9")


@pytest.mark.thorough
@pytest.mark.parametrize("case", COMPLETE)
def test_complete_models_are_recovered_from_concealed_cases(case, shared):
    """Cases that conceal nothing: within 3 standard errors and 2 %, chi-square at one, sealed records predicted."""
    folder = shared / "concealed" / case
    result = fit_experiment(load_experiment(folder))
    nominal = json.loads((folder / "sealed" / "truth.json").read_text())["nominal"]
    omega = math.sqrt(nominal["k"] / nominal["m"])
    truth = {
        "k_i": nominal["ki"],
        "n": nominal["n"],
        "lambda_i": nominal["lam"],
        "zeta": nominal["c"] / (2 * nominal["m"] * omega),
        "f_n": omega / (2 * math.pi),
    }
    for parameter in result.parameters:
        assert abs(parameter.value - truth[parameter.spec.name]) < 3 * parameter.stderr
        assert parameter.value == pytest.approx(truth[parameter.spec.name], rel=0.02)
    assert 0.9 < result.chi2_reduced < 1.1
    for record in load_experiment(folder / "sealed", need_files=False).records:
        predicted = simulate_record(result.model, record)
        for name, values in record.channels.items():
            assert np.sqrt(np.mean((predicted[name] - values) ** 2)) < 0.02 * np.std(values)


def test_a_force_without_which_the_equations_cannot_be_solved_is_reported(monkeypatch):
    """Its gain is infinite."""
    found, solved = fit(problem_of(shaken(1))), elimination.deviance

    def deviance(problem: Problem, at: Estimate, local: Weighed, force: RandomForce) -> float:
        if vanishes(problem, force):
            raise np.linalg.LinAlgError("rounding has spoilt the factorisation")
        return solved(problem, at, local, force)

    monkeypatch.setattr(elimination, "deviance", deviance)
    reported = unrest(found)
    assert reported is not None and reported.gain == np.inf
    assert json.dumps(reported.document(), allow_nan=False)
