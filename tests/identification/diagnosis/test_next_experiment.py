"""The record that would tell two causes apart, beside what closed forms and SciPy say of the same records."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import StateSpace, lfilter, lsim

from identification.diagnosis import next_experiment as module
from identification.diagnosis.next_experiment import Cause, Proposal, next_experiment, separation
from identification.estimation.prediction import record_fits
from identification.trajectory.remodel import remodelled
from vibrojax.effects import EFFECTS

_FORCE = 0.02
"""N; pushes the hammer some 0.04 mm out of its rest."""
_ERRORS, _SAMPLING = {"hammer_displacement": (1e-5, 2.0)}, 1e-3


def cause(scores, effect, **changed: float) -> Cause:
    """The model of `scores` with an effect, its parameters known; some of the nominal ones changed by a factor."""
    one = scores.fitted
    model = dataclasses.replace(one.problem.model_at(one.at), effects=(effect,))
    problem = remodelled(one.problem, one.at, model)
    shared = problem.start.shared.copy()
    for name, factor in changed.items():
        shared[problem.unknowns.index(name)] += np.log(factor)
    return Cause(problem=problem, at=dataclasses.replace(problem.start, shared=shared), root=np.zeros((len(shared), 0)))


def apart(proposal: Proposal, named: Cause, twin: Cause) -> float:
    """Their separation by one record of the displacement."""
    return float(separation([proposal], named, twin, _ERRORS, _SAMPLING)[0])


def decay(frequency: float = 5.0) -> Proposal:
    """From a millimetre, without impacts."""
    return Proposal(1.0, 0.0, frequency, 0.0, -1e-3, 0.0, 12.0, "A free decay")


DRIVEN = Proposal(5e-4, 1.5e-3, 6.5, 0.0, 0.0, 0.0, 4.0, "A driven record")


@pytest.fixture(scope="module")
def pushed(scores) -> tuple[Cause, Cause]:
    """Nearly no constant force, and one."""
    no, some = (cause(scores, EFFECTS["constant_force"](force)) for force in (1e-12, _FORCE))
    return no, some


@pytest.fixture(scope="module")
def records(scores):
    """The present records, explained but for white errors of a hundredth of a millimetre."""
    rng = np.random.default_rng(3)
    return tuple(
        dataclasses.replace(one, measured={name: one.predicted[name] + 1e-5 * rng.standard_normal(len(one.time)) for name in one.measured})
        for one in record_fits(scores.fitted)
    )


def test_a_free_decay_separates_as_far_as_scipy_says(pushed):
    named = pushed[0]
    values, mass = named.problem.values(named.at), named.problem.experiment.mass
    omega = 2.0 * np.pi * values["f_n"]
    free = StateSpace([[0.0, 1.0], [-(omega**2), -2.0 * values["zeta"] * omega]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    time = _SAMPLING * np.arange(int(12.0 / values["f_n"] / _SAMPLING))

    def u(force=0.0, start=(-1e-3, 0.0)):
        return lsim(free, np.full(len(time), force / mass), time, start)[1]

    a_tenth, error = 0.1 * 1e-3, 1e-5 * np.sqrt(2.0)
    unknown = np.array([u(start=(-1e-3 + a_tenth, 0.0)) - u(), u(start=(-1e-3, omega * a_tenth)) - u()]) / error
    distance = (u(_FORCE) - u()) / error
    expected = np.sqrt(distance @ np.linalg.inv(np.eye(len(time)) + unknown.T @ unknown) @ distance)
    assert apart(decay(values["f_n"]), *pushed) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("proposal", [decay(), DRIVEN], ids=["free decay", "driven"])
def test_a_softer_twin_is_as_far_off_as_a_harder_one(scores, proposal):
    drag = EFFECTS["constant_force"](1e-12)
    harder, softer = (apart(proposal, cause(scores, drag), cause(scores, drag, f_n=factor)) for factor in (1.0002, 0.9998))
    assert 1.0 < harder == pytest.approx(softer, rel=0.1)


def test_steps_of_another_size_separate_a_record_with_impacts_as_far(scores, monkeypatch):
    rubbing = [cause(scores, EFFECTS["coulomb_friction"](force)) for force in (1e-12, 2e-3)]
    found = apart(DRIVEN, *rubbing)
    monkeypatch.setattr(module, "_STEP", 0.3 * module._STEP)
    assert 1.0 < apart(DRIVEN, *rubbing) == pytest.approx(found, rel=0.05)


@pytest.mark.parametrize("which", [0, 1], ids=["the named one's", "the twin's"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_a_parameter_may_explain_does_not_separate(pushed, which, side):
    """A force that is known to no better than its own size, at a bound or not."""
    vague = list(pushed)
    vague[which] = dataclasses.replace(pushed[which], root=np.zeros((len(pushed[1].at.shared), 1)))
    vague[which].root[vague[which].problem.unknowns.index("constant_force.constant_force"), 0] = side * _FORCE
    assert apart(decay(), *vague) < 1.5 < 30.0 < apart(decay(), *pushed)


def test_a_gap_that_is_not_known_separates_less(scores, monkeypatch):
    rubbing = [cause(scores, EFFECTS["coulomb_friction"](force)) for force in (1e-12, 2e-3)]
    vague = apart(DRIVEN, *rubbing)
    monkeypatch.setattr(module, "GAP_PRIOR_STD_M", 1e-9)
    assert vague < 0.95 * apart(DRIVEN, *rubbing)


def test_a_stop_that_rings_fast_is_followed(scores, pushed):
    assert np.isfinite(apart(DRIVEN, pushed[0], cause(scores, EFFECTS["stop_compliance"](1e7, 500.0, 0.05))))


def test_errors_last_as_long_as_they_are_correlated(scores, records):
    """A first-order process with 0.9 from sample to sample: (1 + 0.9) / (1 - 0.9) samples."""
    rng, experiment = np.random.default_rng(1), scores.fitted.problem.experiment
    (one,) = [record for record in records if record.kind == "cart-excitation"]
    error = lfilter([1e-5], [1.0, -0.9], rng.standard_normal(len(one.time)))
    errors = {"hammer_displacement": error, "cart_displacement": 1e-5 * rng.standard_normal(len(one.time))}
    one = dataclasses.replace(one, measured={name: one.predicted[name] + error for name, error in errors.items()})
    found = module._errors(experiment, (one,))
    assert found["hammer_displacement"] == (pytest.approx(np.std(error), rel=0.05), pytest.approx(19.0, rel=0.5))
    assert found["cart_displacement"] == (pytest.approx(1e-5, rel=0.05), pytest.approx(1.0, abs=0.3))
    driven = tuple(dataclasses.replace(record, base="measured") for record in experiment.records)
    assert list(module._errors(dataclasses.replace(experiment, records=driven), (one,))) == ["hammer_displacement"]


def test_the_record_that_separates_the_least_alike_twin_best_is_named(scores, records, pushed, monkeypatch):
    proposals = list(module._proposals(scores.fitted.problem.experiment, pushed[0], records))
    at_rest = max(place for place, one in enumerate(proposals) if not one.amplitude)

    def distances(proposals, named, twin, errors, sampling):
        return np.array([5.0 if one.amplitude else 40.0 for one in proposals]) if twin is pushed[1] else 1.5 + np.arange(len(proposals))

    monkeypatch.setattr(module, "separation", distances)
    twins = {"quadratic_drag": pushed[1], "hysteresis": pushed[0]}
    said = next_experiment(scores.fitted.problem.experiment, pushed[0], twins, "coulomb_friction", records)
    separated = f"would separate coulomb friction from quadratic drag and hysteresis by {at_rest + 1.5} standard errors."
    assert said == f"{proposals[at_rest].text} {separated}"


def test_one_cause_is_not_separated_from_itself(scores, records, pushed):
    said = next_experiment(scores.fitted.problem.experiment, pushed[0], {"back_stop": pushed[0]}, "constant_force", records)
    assert said.startswith("Of 21 further records that were simulated none would separate constant force from back stop by more than 0 ")


def test_nothing_is_said_of_what_acts_otherwise_in_each_record(scores, records, pushed):
    hum = cause(scores, EFFECTS["mains_hum"](50.0, 1e-5, 0.0, of_channel="hammer_displacement"))
    experiment = scores.fitted.problem.experiment
    assert next_experiment(experiment, pushed[0], {"mains_hum": hum}, "constant_force", records) == ""
    assert next_experiment(experiment, hum, {"constant_force": pushed[0]}, "mains_hum", records) == ""


def test_a_cause_keeps_what_its_fit_knows(scores):
    """One of two directions of a covariance, of natural sizes; what is not identified counts as known to one size."""
    one = scores.fitted
    covariance = np.zeros((len(one.at.shared),) * 2)
    covariance[0, 0], covariance[1, 1] = 0.04, 1e9
    found = Cause.of(dataclasses.replace(one, solution=dataclasses.replace(one.solution, covariance=covariance)))
    sizes = one.problem.border.shared_scale[:2] * [0.2, 1.0]
    np.testing.assert_allclose(found.root @ found.root.T, np.diag([*(sizes**2), *np.zeros(len(covariance) - 2)]), atol=1e-12)
