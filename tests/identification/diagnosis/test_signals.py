"""What an effect adds along the motion, against the chain's own readings with the effect in the model."""

import dataclasses

import jax
import numpy as np
import pytest

from identification.diagnosis.augment import extended
from identification.trajectory.course import responses
from identification.trajectory.motion import passed, vectors_of
from identification.trajectory.start import Problem
from tests.identification.diagnosis.candidates import probed
from vibrojax.compiling import soon_compiled

_passed = soon_compiled(passed)
SMALL = 1e-3
"""Of the strength at which an effect is probed: first order."""
CASES = ("quadratic_drag", "gap_drift", "second_mode", "reading_tone", "gain_error")
"""A force, a shift of the stop, one with states of its own, one with numbers of its own in each record, and a reading's error."""


def integrated(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Readings over the noise, and u and u' at the end of every segment, each integrated from its knot at the first estimate."""
    chains, at = problem.chains, problem.start
    vectors, model = vectors_of(chains, at), jax.tree.map(np.asarray, problem.model_at(at))
    readings, end = np.zeros(chains.measured.shape), np.zeros((len(chains.left), 2))
    for group in chains.groups:
        (value, last), done = _passed(model, problem.unknowns, chains.files, problem.integrator, group, vectors[group.place])
        assert np.all(done)
        readings[group.place], end[group.place] = value, np.asarray(last)[:, :2]
    return readings * chains.weight, end


@pytest.fixture(scope="module")
def nominal(scores) -> tuple[np.ndarray, np.ndarray]:
    """Without an effect."""
    return integrated(dataclasses.replace(scores.fitted.problem, start=scores.fitted.at))


@pytest.mark.parametrize("name", CASES)
def test_signals_are_the_change_of_the_readings(scores, nominal, name):
    candidate = probed(scores, name)
    strengths = np.full(len(candidate.signals), SMALL)
    problem, near = extended(scores, candidate, strengths)
    readings, end = integrated(dataclasses.replace(problem, start=near))
    seen_by, end_by = responses(scores.by, scores.fitted.problem.chains, list(candidate.signals))
    for found, whole, before in ((seen_by @ strengths, readings, nominal[0]), (end_by[:, :2] @ strengths, end, nominal[1])):
        change = whole - before
        off = np.sqrt(np.mean((found - change) ** 2))
        assert off < 0.02 * np.sqrt(np.mean(change**2)) or not change.any(), name
    assert np.abs(readings - nominal[0]).max() > 0.0
