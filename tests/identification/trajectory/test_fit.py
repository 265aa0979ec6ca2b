"""Fits of chains: a rig of known truth, a rig that is shaken, a whole record by least squares, and a body that bounces on a rigid stop."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import least_squares

from identification.trajectory import fit as module
from identification.trajectory.elimination import solved
from identification.trajectory.fit import Fitted, _rank, equations, fit, settled
from identification.trajectory.motion import Estimate
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.segments import at_ceiling, not_shown
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.step import Stride, moved
from identification.trajectory.variances import LARGEST_FORCE, OF_TWO_NUMBERS, SMALLEST_FORCE, Variances, is_no_mode, likeliest, reweighed
from tests.identification.conftest import TRUTH
from tests.identification.trajectory.conftest import F_N, FORCE, MEMORY, NOISE, ZETA, Linear, shaken


def test_a_small_experiment_gives_its_true_parameters_and_no_random_force(small):
    problem = problem_of(small)
    found = fit(problem)
    assert found.converged
    assert found.variances.force.std == SMALLEST_FORCE * problem.scales.force, "one that does not pay for its two numbers goes"
    assert all(one.order == 0 for one in found.variances.readings)
    values = problem.values(found.at)
    for (name, logarithmic), error in zip(problem.unknowns.shared, found.stderr, strict=True):
        off = np.log(values[name] / TRUTH[name]) if logarithmic else values[name] - TRUTH[name]
        assert abs(off) < 3.0 * error, name


def test_a_shaken_rig_gives_its_parameters_and_the_force(vibrating):
    found = fit(vibrating)
    values = vibrating.values(found.at)
    assert found.converged
    for name, error, truth in zip(("zeta", "f_n"), found.stderr, (ZETA, F_N), strict=True):
        assert abs(np.log(values[name] / truth)) < 3.0 * error
    assert 0.5 * FORCE < found.variances.force.std < 2.0 * FORCE
    assert found.variances.readings[0].std == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(("std", "memory"), [(2.0, 0.2), (5.0, 0.1)])
def test_likeliest_variances_are_found_from_a_large_and_slow_random_force(small, std, memory):
    """Of thousands of readings each says little of the force: beside their steepness its own hardly shows."""
    problem = problem_of(small)
    force = RandomForce(std=std * 1e-2 * problem.scales.force, memory=memory)
    begin = Variances(force=force, readings=tuple(ReadingError(coefficients=(0.1, 0.1)) for _ in problem.chains.channels))
    linear, *_ = equations(problem, problem.start, begin)

    def least(begin: Variances) -> float:
        found, readings = likeliest(problem, problem.start, linear, begin)
        return solved(problem, problem.start, reweighed(problem, problem.start, linear, readings), found).deviance

    there = dataclasses.replace(begin, force=RandomForce(std=1e-2 * problem.scales.force, memory=1e-3))
    assert least(begin) == pytest.approx(least(there), abs=2.0)


def test_a_round_ends_where_the_likelihood_stays_though_the_parameters_are_held(small):
    """From a motion that is 0.1 mm off: one step leaves hundreds of -2 log likelihood to gain."""
    problem = problem_of(small)
    held = dataclasses.replace(problem.border, shared=np.zeros_like(problem.border.shared))
    problem, begin = dataclasses.replace(problem, border=held), module.first_variances(problem)
    small_force = dataclasses.replace(begin, force=RandomForce(std=1e-3 * begin.force.std, memory=begin.force.memory))
    off = dataclasses.replace(problem.start, states=problem.start.states + 1e-4)

    def deviance(at: Estimate) -> float:
        return equations(problem, at, small_force)[2].deviance

    *_, solution = equations(problem, off, small_force)
    once = moved(problem, off, solution, 1.0)
    twice = moved(problem, once, equations(problem, once, small_force)[2], 1.0)
    there, _, _, last = module._while_likelier(problem, off, small_force, solution, Stride(problem))
    assert deviance(once) - deviance(twice) > 100.0
    assert last.deviance <= deviance(twice)
    assert last.deviance - deviance(moved(problem, there, last, 1.0)) < OF_TWO_NUMBERS


@pytest.mark.parametrize(
    ("path", "ends"),
    [
        ((100.0, 99.0, 0.0), 1),
        ((100.0, 120.0, 0.0), 1),
        ((100.0, 50.0, 60.0, 0.0), 1),
        ((100.0, 50.0, 20.0, 19.0, 0.0), 3),
        ((100.0, 50.0, None), 1),
        (tuple(np.arange(100.0, 0.0, -10.0)), 6),
    ],
)
def test_further_steps_are_taken_while_each_makes_the_motion_likelier(vibrating, monkeypatch, path, ends):
    """-2 log likelihood by step; None where the equations are singular."""

    def there(problem: Problem, at: int, variances: Variances) -> tuple:
        if path[at] is None:
            raise np.linalg.LinAlgError
        return SimpleNamespace(done=np.ones(3)), None, SimpleNamespace(deviance=path[at])

    monkeypatch.setattr(module, "moved", lambda problem, at, *step: at + 1)
    monkeypatch.setattr(module, "equations", there)
    stride = SimpleNamespace(taken=lambda at, solution: (solution, 1.0))
    at, *_, solution = module._while_likelier(vibrating, 0, module.first_variances(vibrating), SimpleNamespace(deviance=path[0]), stride)
    assert at == ends and solution.deviance == path[ends]


def test_without_a_force_the_chain_is_one_trajectory_fitted_by_least_squares():
    """Estimate and standard error of a whole record, by SciPy on the closed form."""
    experiment = shaken(1)
    record = experiment.records[0]
    phi = np.array([expm(Linear().rates * t) for t in record.time])[:, 0]
    measured = phi @ [5e-3, 0.0] + NOISE * np.random.default_rng(8).standard_normal(len(record.time))
    quiet = dataclasses.replace(experiment, records=(dataclasses.replace(record, channels={"hammer_displacement": measured}),))
    found = fit(problem_of(quiet))

    def misfit(x: np.ndarray) -> np.ndarray:
        zeta, omega = np.exp(x[0]), 2.0 * np.pi * np.exp(x[1])
        damped = omega * np.sqrt(1.0 - zeta**2)
        envelope = np.exp(-zeta * omega * record.time)
        return (envelope * (x[2] * np.cos(damped * record.time) + x[3] * np.sin(damped * record.time)) - measured) / NOISE

    whole = least_squares(misfit, [np.log(ZETA), np.log(F_N), 5e-3, 0.0], x_scale=[1.0, 1.0, 1e-3, 1e-3], xtol=1e-14, ftol=1e-14)
    stderr = np.sqrt(np.diag(np.linalg.inv(whole.jac.T @ whole.jac)))[:2]
    scale = found.variances.readings[0].std
    assert found.variances.force.std < 10.0 * SMALLEST_FORCE * found.problem.scales.force
    assert np.allclose(found.at.shared, whole.x[:2], atol=0.05 * stderr.max())
    assert np.allclose(found.stderr, scale * stderr, rtol=0.02)


def test_a_slow_reading_error_is_no_random_force():
    """A free decay at 1 kHz, read with an error that is correlated for 20 ms, a twelfth of a period, and no force."""
    rng, pole, rate, count = np.random.default_rng(9), 0.95, 1000.0, 1500
    experiment = shaken(1)
    phi = expm(Linear().rates / rate)
    z, u, error = np.array([5e-3, 0.0]), [], NOISE * np.sqrt(1.0 / (1.0 - pole**2)) * rng.standard_normal()
    for _ in range(count):
        u.append(z[0] + error)
        z, error = phi @ z, pole * error + NOISE * rng.standard_normal()
    record = dataclasses.replace(experiment.records[0], time=np.arange(count) / rate, channels={"hammer_displacement": np.array(u)})
    problem = problem_of(dataclasses.replace(experiment, records=(record,)))
    found = fit(problem)
    assert found.converged
    assert found.variances.force.std < 1e-3 * problem.scales.force
    assert found.variances.readings[0].coefficients[0] == pytest.approx(pole, abs=0.05)
    values = problem.values(found.at)
    for name, error, truth in zip(("zeta", "f_n"), found.stderr, (ZETA, F_N), strict=True):
        assert abs(np.log(values[name] / truth)) < 3.0 * error


def test_the_ceiling_of_a_load_cell_counts_since_an_effect_explains_it():
    wave = np.clip(np.sin(np.linspace(0.0, 40.0, 400)), -0.8, 0.9)
    assert not_shown("hammer_acceleration", wave).sum() == np.sum((wave >= 0.9) | (wave <= -0.8))
    assert not_shown("impact_force", wave).sum() == np.sum(wave <= -0.8)


def test_samples_at_a_ceiling_do_not_count():
    wave = np.sin(np.linspace(0.0, 40.0, 400))
    assert not at_ceiling(wave).any()
    assert at_ceiling(np.minimum(wave, 0.9)).sum() == np.sum(wave >= 0.9)


@pytest.mark.parametrize(("rate", "decay"), [(500.0, 0.01), (1000.0, 0.05)])
def test_a_further_mode_in_the_acceleration_is_no_random_force(rate, decay):
    """Free decays of which only the acceleration is read, with a ringing of another mode of a third of its size: a force as large as it may
    be explains them too, and would leave the damping ratio six times too large."""
    rng, time, omega, noise = np.random.default_rng(3), np.arange(200) / rate, 2.0 * np.pi * 40.0, 1.0
    rates, records = Linear(omega=omega).rates, []
    for index in range(4):
        motion = np.array([expm(rates * t) @ [5e-3 + 1e-3 * index, 0.0] for t in time])
        acceleration = motion @ rates[1]
        ringing = 0.35 * np.abs(acceleration).max() * np.exp(-decay * 2.3 * omega * time) * np.cos(2.3 * omega * time + index)
        record = dataclasses.replace(shaken(1).records[0], file=f"decay{index}.csv", time=time, noise={"hammer_acceleration": noise})
        read = acceleration + ringing + noise * rng.standard_normal(len(time))
        records.append(dataclasses.replace(record, channels={"hammer_acceleration": read}))
    found = fit(problem_of(dataclasses.replace(shaken(1), records=tuple(records))))
    assert found.converged
    assert not is_no_mode(found.problem, found.variances.force)
    for place, truth in enumerate((ZETA, 40.0)):
        assert abs(found.at.shared[place] - np.log(truth)) < max(3.0 * found.stderr[place], 0.05) < 0.5


def test_a_model_does_not_gain_by_comparing_fewer_readings(vibrating):
    """The noise is ten times the declared one, so that each reading costs 4.6 and more; the last tenth of them is not compared."""
    chains = vibrating.chains
    kept = np.arange(len(chains.left)) % (len(chains.left) // 2) < 0.9 * (len(chains.left) // 2)
    groups = tuple(dataclasses.replace(one, weight=one.weight * kept[one.place][:, None, None]) for one in chains.groups)
    fewer = dataclasses.replace(chains, groups=groups, weight=chains.weight * kept[:, None, None])
    variances = Variances(force=RandomForce(std=FORCE, memory=MEMORY), readings=(ReadingError(innovation=10.0),))
    whole, part = (settled(dataclasses.replace(vibrating, chains=one), vibrating.start, variances) for one in (chains, fewer))
    assert part.local.samples < whole.local.samples
    assert whole.deviance == whole.solution.deviance
    lost = whole.local.samples - part.local.samples
    assert whole.solution.deviance - part.solution.deviance > 3.0 * lost
    assert abs(whole.deviance - part.deviance) < 0.5 * lost


def test_of_two_ends_a_converged_one_counts_then_a_mode_then_the_likelier_one(vibrating):
    found = fit(vibrating, both=False)
    force = RandomForce(std=LARGEST_FORCE * vibrating.scales.force, memory=0.1)
    likelier = dataclasses.replace(found.solution, deviance=found.solution.deviance - 1.0)
    at_limit = dataclasses.replace(found, solution=likelier, variances=dataclasses.replace(found.variances, force=force))
    lost = dataclasses.replace(found, converged=False)
    likelier_lost = dataclasses.replace(lost, solution=likelier)
    ends = [lost, at_limit, likelier_lost, found]
    assert [id(one) for one in sorted(ends, key=_rank)] == [id(one) for one in (found, at_limit, likelier_lost, lost)]


def rounds(problem, monkeypatch, *, diverging: bool, first: Fitted | None = None) -> tuple[Fitted | None, list[str]]:
    """An end of a fit whose random force stays as large as it may be, and its lines of progress."""
    said: list[str] = []
    rng, begin = np.random.default_rng(0), module.first_variances(problem)
    with monkeypatch.context() as patch:
        patch.setattr(module, "annealed", lambda problem, at, local, force, **given: force)
        if diverging:
            patch.setattr(module, "change", lambda *given: 1.0)
        return module._converged_or_none(problem, problem.start, begin, rng, said.append, coloured_from=0, first=first), said


def test_an_end_that_diverges_beside_the_largest_force_is_polished_once(vibrating, monkeypatch):
    """Of the last round there is one line, and one for each step with polished variances."""
    (found, said), (_, others) = (rounds(vibrating, monkeypatch, diverging=diverging) for diverging in (True, False))
    assert found is not None and not found.converged
    polished, usual = (sum(line.split(":")[0] == lines[-1].split(":")[0] for line in lines) - 1 for lines in (said, others))
    assert polished == 1 and usual >= 2


def test_an_end_that_stays_at_the_largest_force_is_dropped_beside_one_that_has_converged_to_a_mode(vibrating, monkeypatch):
    """Its parameters are far from those of that one: near them it would be dropped in any case."""
    first = fit(vibrating)
    first = dataclasses.replace(first, at=dataclasses.replace(first.at, shared=first.at.shared + 100.0 * first.stderr))
    found, said = rounds(vibrating, monkeypatch, diverging=False, first=first)
    assert found is None and len(said) == 1
    largest = RandomForce(std=LARGEST_FORCE * vibrating.scales.force, memory=0.1)
    at_limit = dataclasses.replace(first, variances=dataclasses.replace(first.variances, force=largest))
    for other in (dataclasses.replace(first, converged=False), at_limit):
        found, said = rounds(vibrating, monkeypatch, diverging=False, first=other)
        assert found is not None and len(said) > 2


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_reading_errors_change_beside_the_largest_force_only_where_a_smaller_one_is_likelier_with_them(vibrating, monkeypatch, share):
    begin = module.first_variances(vibrating)
    begin = dataclasses.replace(begin, readings=(ReadingError(coefficients=(0.5,), innovation=2.0),))
    joint = dataclasses.replace(begin.force, std=share * begin.force.std), (ReadingError(innovation=7.0),)
    asked = []
    monkeypatch.setattr(module, "_holds_readings", module.is_largest)
    monkeypatch.setattr(module, "likeliest", lambda *given, iterations: asked.append(iterations) or joint)
    monkeypatch.setattr(module, "annealed", lambda problem, at, local, force, **given: force)
    monkeypatch.setattr(module, "coloured", lambda problem, at, linear, local, force, rng, draws: joint[1])
    rng = np.random.default_rng(0)
    found = module._with_likeliest(vibrating, vibrating.start, begin, rng, lambda line: None, rounds=1, diverges=False)
    assert found.variances.readings == (begin.readings if share == 1.0 else joint[1])
    assert asked == [12]


def test_force_and_reading_errors_are_searched_together_again_once_the_force_has_fallen(vibrating, monkeypatch):
    begin = module.first_variances(vibrating)
    begin = dataclasses.replace(begin, readings=(ReadingError(coefficients=(0.5,), innovation=2.0),))
    fallen, asked = dataclasses.replace(begin.force, std=0.1 * begin.force.std), []
    monkeypatch.setattr(module, "_holds_readings", module.is_largest)
    monkeypatch.setattr(module, "likeliest", lambda *given, iterations: asked.append(iterations) or (begin.force, begin.readings))
    monkeypatch.setattr(module, "annealed", lambda *given, **named: fallen)
    monkeypatch.setattr(module, "coloured", lambda problem, at, linear, local, force, rng, draws: begin.readings)
    monkeypatch.setattr(module, "force_if_it_pays", lambda problem, at, local, force: (force, solved(problem, at, local, force)))
    module._with_likeliest(vibrating, vibrating.start, begin, np.random.default_rng(0), lambda line: None, rounds=1, diverges=False)
    assert len(asked) > 1
