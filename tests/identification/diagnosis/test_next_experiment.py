"""The record that would tell two causes apart, beside what closed forms and SciPy say of the same records."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from identification.diagnosis import next_experiment as module
from identification.diagnosis.next_experiment import Cause, Wish, next_experiment
from identification.estimation.prediction import record_fits
from identification.trajectory.remodel import remodelled
from vibrojax.effects import EFFECTS

_FORCE = 0.02
"""N; pushes the hammer some 0.04 mm out of its rest."""
_ERRORS = {"hammer_displacement": (1e-5, 400.0)}


def cause(seen, effect, known: float = 0.0) -> Cause:
    """The model of `seen` with an effect, its parameters known to within `known` natural sizes."""
    one = seen.fitted
    model = dataclasses.replace(one.problem.model_at(one.at), effects=(effect,))
    problem = remodelled(one.problem, one.at, model)
    return Cause(problem=problem, at=problem.start, root=known * np.diag(problem.border.shared_scale))


@pytest.fixture(scope="module")
def pushed(seen) -> tuple[Cause, Cause]:
    """Nearly no constant force, and one."""
    return tuple(cause(seen, EFFECTS["constant_force"](force)) for force in (1e-12, _FORCE))


@pytest.fixture(scope="module")
def records(seen):
    """The present records, explained but for white errors of a hundredth of a millimetre."""
    rng = np.random.default_rng(3)
    return tuple(
        dataclasses.replace(one, measured={name: one.predicted[name] + 1e-5 * rng.standard_normal(len(one.time)) for name in one.measured})
        for one in record_fits(seen.fitted)
    )


def test_a_free_decay_separates_as_far_as_scipy_says(pushed):
    named = pushed[0]
    values, mass = named.problem.values(named.at), named.problem.experiment.mass
    omega = 2.0 * np.pi * values["f_n"]
    free = StateSpace([[0.0, 1.0], [-(omega**2), -2.0 * values["zeta"] * omega]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    time = np.linspace(0.0, 12.0 / values["f_n"], 1200)

    def u(force=0.0, start=(-1e-3, 0.0)):
        return lsim(free, np.full(1200, force / mass), time, start)[1]

    part = 0.1 * 1e-3
    size = np.sqrt(400.0 * time[-1] / 1200) / 1e-5
    unknown = [u(start=(-1e-3 + part, 0.0)) - u(), u(start=(-1e-3, omega * part)) - u()]
    known, apart = np.array(unknown) * size, (u(_FORCE) - u()) * size
    inverse = np.linalg.inv(np.eye(1200) + known.T @ known)
    wish = Wish(1.0, 0.0, values["f_n"], -1e-3, 0.0, "A free decay")
    assert module._separation([wish], *pushed, _ERRORS)[0] == pytest.approx(np.sqrt(apart @ inverse @ apart), rel=1e-3)


def test_what_a_parameter_may_explain_does_not_separate(seen, pushed):
    """A force that is known to no better than its own size."""
    vague = dataclasses.replace(pushed[1], root=np.zeros((len(pushed[1].at.shared), 1)))
    place = vague.problem.unknowns.index("constant_force.constant_force")
    vague.root[place, 0] = _FORCE
    wish = Wish(1.0, 0.0, 5.0, -1e-3, 0.0, "A free decay")
    assert module._separation([wish], pushed[0], vague, _ERRORS)[0] < 1.5 < 30.0 < module._separation([wish], *pushed, _ERRORS)[0]


def test_the_record_that_separates_the_least_alike_twin_best_is_named(seen, records, pushed, monkeypatch):
    def apart(wishes, named, twin, errors):
        return np.array([5.0 if wish.amplitude else 40.0 for wish in wishes]) if twin is pushed[1] else np.arange(1.0, 1.0 + len(wishes))

    monkeypatch.setattr(module, "_separation", apart)
    twins = {"quadratic_drag": pushed[1], "hysteresis": pushed[0]}
    wishes = list(module._wishes(seen.fitted.problem.experiment, pushed[0], records))
    said = next_experiment(seen.fitted.problem.experiment, pushed[0], twins, "coulomb_friction", records)
    last_at_rest = max(place for place, wish in enumerate(wishes) if not wish.amplitude)
    separated = f"would tell coulomb friction from quadratic drag and hysteresis by {last_at_rest + 1} standard errors."
    assert said == f"{wishes[last_at_rest].text} {separated}"


def test_one_cause_is_not_told_from_itself(seen, records, pushed):
    said = next_experiment(seen.fitted.problem.experiment, pushed[0], {"back_stop": pushed[0]}, "constant_force", records)
    assert said.startswith("Of 33 further records that were simulated none would tell constant force from back stop by more than 0 ")


def test_a_cause_keeps_what_its_fit_knows(seen):
    """One of two directions of a covariance, of natural sizes; what is not identified counts as known to one size."""
    one = seen.fitted
    covariance = np.zeros((len(one.at.shared),) * 2)
    covariance[0, 0], covariance[1, 1] = 0.04, 1e9
    found = Cause.of(dataclasses.replace(one, solution=dataclasses.replace(one.solution, covariance=covariance)))
    sizes = one.problem.border.shared_scale[:2] * [0.2, 1.0]
    np.testing.assert_allclose(found.root @ found.root.T, np.diag([*(sizes**2), *np.zeros(len(covariance) - 2)]), atol=1e-12)
