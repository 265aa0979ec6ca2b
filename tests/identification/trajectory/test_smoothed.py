"""Fits with Diffrax on the smoothed contact law, beside the chain."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.smoothed_fit.rig import compliant_laws, simulated
from benchmarks.smoothed_fit.trial import trial, whole
from identification.trajectory import smoothed
from identification.trajectory.motion import segment_system
from identification.trajectory.segments import chains_of
from identification.trajectory.smoothed import fit_smoothed
from identification.trajectory.start import Problem, problem_of
from vibrojax.effects import CoulombFriction
from vibrojax.errors import InputError

SLOPES = {
    "hunt-crossley": 3.5,
    "hunt-crossley-separate": 3.5,
    "hertz": 3.5,
    "kelvin-voigt": 2.0,
    "kelvin-voigt-clipped": 2.0,
    "lankarani-nikravesh": 2.6,
    "flores": 2.6,
}
"""Order of the motion, n + 2, and 2 for a force that jumps at the touch; with the speed at the touch as measured (docs/theory.md)."""
LAWS = [pytest.param(law, marks=[pytest.mark.thorough] * (law != "hunt-crossley")) for law in compliant_laws()]


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(simulated("hunt-crossley", samples=300, seed=0))


@pytest.mark.parametrize("law", LAWS)
def test_estimates_come_to_those_of_the_chain_with_the_width(law):
    found = trial(law, np.array([1e-4, 3e-4]), samples=2000)
    assert found.converged.all()
    assert found.largest[0] > 20.0 * found.floor
    assert found.slope == pytest.approx(SLOPES[law], abs=0.4)


@pytest.mark.thorough
def test_noisy_records_have_the_estimates_of_the_chain():
    """Within a tenth of a standard error: the chain finds a random force where there is none, of a thousandth of the suspension's."""
    chain, found = whole("hunt-crossley", 1e-6, samples=1200, seed=0)
    assert found.converged
    assert np.abs((found.estimate.shared - chain.at.shared) / chain.stderr).max() < 0.1
    assert np.abs(found.estimate.states - chain.at.states).max(axis=0) == pytest.approx(0.0, abs=1e-4)


@pytest.mark.thorough
def test_a_record_in_stretches_finds_the_same(monkeypatch):
    whole_records = trial("hunt-crossley", np.array([1e-5]), samples=1200)
    monkeypatch.setattr(smoothed, "_lengths", lambda problem, at: [28, 55])
    stretches = trial("hunt-crossley", np.array([1e-5]), samples=1200)
    assert stretches.converged.all()
    assert stretches.largest[0] == pytest.approx(whole_records.largest[0], abs=0.01)


def test_a_motion_that_diverges_is_cut(problem, monkeypatch):
    whole_records = smoothed._lengths(problem, problem.start)
    assert whole_records == [max(knots.stop - knots.start for knots in problem.chains.knots) - 1] * 2
    monkeypatch.setattr(smoothed, "_LARGEST_ERROR", 0.0)
    assert smoothed._lengths(problem, problem.start) == [1, 1]


def test_the_random_force_is_held_along_a_stretch(problem):
    """Linear from knot to knot."""
    knots = problem.chains.knots[0]
    one = chains_of(problem.experiment.records[:1], 2 * problem.chains.samples).groups[0]
    stretch = jax.tree.map(lambda leaf: leaf[0], one)
    border = np.concatenate([problem.start.shared, problem.start.own[0]])
    vector = jnp.asarray(np.concatenate([problem.start.states[knots.start], [1.0, 3.0, 2.0], border]))
    system = segment_system(problem.model, problem.unknowns, problem.chains.files, stretch, vector)
    ends = stretch.ts[[0, problem.chains.samples, -1]]
    between = np.concatenate([ends, 0.5 * (ends[1:] + ends[:-1])])
    np.testing.assert_allclose([system.applied.force(jnp.asarray(t)) for t in between], [1.0, 3.0, 2.0, 2.0, 2.5], rtol=1e-9)


@pytest.mark.parametrize("width", [0.0, -1e-6, float("nan"), float("inf")])
def test_a_width_that_is_no_length_is_refused(problem, width):
    with pytest.raises(InputError, match="the width of the smoothed contact is .* m: expected a length above 0"):
        fit_smoothed(problem, problem.start, smoothing=width)


def test_a_rigid_stop_is_refused(problem):
    records = [
        dataclasses.replace(one, channels={name: values for name, values in one.channels.items() if name != "impact_force"})
        for one in problem.experiment.records
    ]
    rigid = problem_of(dataclasses.replace(problem.experiment, records=tuple(records)), law="newton")
    with pytest.raises(InputError, match="the stop of law 'newton' is rigid, so it has no force to smooth"):
        fit_smoothed(rigid, rigid.start, smoothing=1e-6)


def test_effects_are_refused(problem):
    extended = dataclasses.replace(problem, model=dataclasses.replace(problem.model, effects=(CoulombFriction(0.05),)))
    with pytest.raises(InputError, match="the smoothed integrator integrates neither effects nor filters"):
        fit_smoothed(extended, problem.start, smoothing=1e-6)
