"""Segments put together are the trajectory of the whole record, for every law; their derivatives are those of differences."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.experiment import Experiment
from identification.trajectory.motion import Estimate, linearise
from identification.trajectory.start import Problem, problem_of
from tests.identification.conftest import TRUTH
from vibrojax.contact import LAWS
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.simulation import simulate

FINE = Landing(contact_steps=jnp.asarray(400.0), flight_step=jnp.asarray(1e-4))


def along(problem: Problem, record: int = 0) -> tuple[Estimate, dict[str, np.ndarray]]:
    """The estimate with the knots of one record on the model's own trajectory, and what the model reads there."""
    chains, knots = problem.chains, problem.chains.knots[record]
    segments = chains.of_record(record)
    count = (segments.stop - segments.start) * chains.samples + 1
    dt = float(chains.duration[0]) / chains.samples
    begin = np.array([-3e-3, 0.0])
    model = problem.model_at(problem.start)
    ts = dt * jnp.arange(count, dtype=float)
    read = simulate(model, ts, gap=0.0, base=at_rest(), y0=jnp.asarray(begin), integrator=FINE)
    system = model.system(gap=0.0, base=at_rest(), applied=Unforced())
    path = FINE(system, ts, jnp.asarray(begin))
    states = problem.start.states.copy()
    states[knots, 0], states[knots, 1] = np.asarray(path.u)[:: chains.samples], np.asarray(path.v)[:: chains.samples]
    if problem.unknowns.states[-1] == "approach_speed":
        states[knots, 2] = np.asarray(path.approach_speed)[:: chains.samples]
    own = problem.start.own.copy()
    own[record] = 0.0
    return dataclasses.replace(problem.start, states=states, own=own), {name: np.asarray(one) for name, one in read.items()}


def with_law(small: Experiment, law: str) -> Problem:
    """The drop test of the example under another law; a rigid stop is not read by a load cell."""
    record = small.records[0]
    channels = {name: values for name, values in record.channels.items() if law != "newton" or name != "impact_force"}
    problem = problem_of(dataclasses.replace(small, records=(dataclasses.replace(record, channels=channels),)), law=law)
    return dataclasses.replace(problem, integrator=FINE)


@pytest.mark.parametrize("law", sorted(set(LAWS) - {"none"}))
def test_segments_follow_the_trajectory_of_the_whole_record(small, law):
    problem = with_law(small, law)
    at, read = along(problem)
    found = linearise(problem.model_at(at), problem.unknowns, problem.chains, problem.integrator, at, problem.scales.states)
    assert found.done.all()
    sizes = problem.scales.states
    assert np.max(np.abs(at.states[problem.chains.left + 1] - found.end) / sizes) < 2e-5
    column = problem.chains.channels.index("hammer_displacement")
    weight, measured = problem.chains.weight[..., column], problem.chains.measured[..., column]
    used = weight > 0
    predicted = found.residual[..., column][used] / weight[used] + measured[used]
    expected = read["hammer_displacement"][:-1].reshape(weight.shape)[used]
    assert np.max(np.abs(predicted - expected)) < 1e-5 * sizes[0]


def test_derivatives_are_those_of_central_differences(small):
    problem = problem_of(small)
    at, chains, unknowns = problem.start, problem.chains, problem.unknowns
    sizes = problem.scales.states

    def moved(column: int, by: float) -> Estimate:
        begin = len(unknowns.states) + 2
        if column < len(unknowns.states):
            return dataclasses.replace(at, states=at.states + by * np.eye(len(unknowns.states))[column])
        if column < begin + len(unknowns.shared):
            return dataclasses.replace(at, shared=at.shared + by * np.eye(len(at.shared))[column - begin])
        return dataclasses.replace(at, own=at.own + by * np.eye(at.own.shape[1])[column - begin - len(at.shared)])

    def ends(one: Estimate) -> np.ndarray:
        return linearise(problem.model_at(one), unknowns, chains, problem.integrator, one, sizes).end

    found = linearise(problem.model_at(at), unknowns, chains, problem.integrator, at, sizes)
    shared = len(unknowns.states) + 2
    steps = {0: 1e-8, 1: 1e-6, shared + unknowns.index("f_n"): 1e-5, shared + unknowns.index("k_i"): 1e-4, shared + len(TRUTH) + 2: 1e-8}
    for column, step in steps.items():
        slope = (ends(moved(column, step)) - ends(moved(column, -step))) / (2.0 * step)
        scale = np.abs(found.end_by[..., column]).max(axis=0)
        off = np.abs(slope - found.end_by[..., column]) / scale
        assert np.quantile(off, 0.99) < 1e-3, column
