"""The mode of parameters, states and random force together."""

import dataclasses

import numpy as np
import pytest

from identification.fit import fit
from identification.likelihood.fitted import first_point
from identification.likelihood.joint import JointMode, Point, point
from identification.likelihood.marginal import estimated_force
from identification.prepare import prepare
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def start(example) -> Point:
    """The example, two records shortened, near least squares, under a small force that is not the one of its mode."""
    prepared = prepare(cropped(example, 2000, (0, 1)))
    begin = first_point(prepared, fit(prepared).estimate)
    variances = dataclasses.replace(begin.variances, degrees=1e4)
    rng, size = np.random.default_rng(0), 0.1 * begin.variances.force.std
    estimate = dataclasses.replace(
        begin.estimate,
        shared=begin.estimate.shared + 1e-4 * rng.normal(size=len(begin.estimate.shared)),
        force=size * rng.normal(size=begin.estimate.force.shape),
    )
    return point(prepared, estimate, variances)


@pytest.fixture(scope="module")
def mode(start) -> Point:
    """Where it is reached from there."""
    return JointMode(most_iterations=40)(start)


def moved(here: Point, shared: np.ndarray, states: np.ndarray, force: np.ndarray) -> float:
    """Cost beside a point."""
    nothing = np.zeros_like(here.estimate.nuisances)
    estimate = dataclasses.replace(here.estimate.moved(shared, nothing, states), force=here.estimate.force + force)
    return point(here.prepared, estimate, here.variances, like=here).cost


def test_gradient_with_the_force_held_is_that_of_the_cost(start):
    """By central differences, along each shared parameter and along states of all windows."""
    layout, equations = start.prepared.layout, start.equations(1e12)
    no_force, no_states = np.zeros_like(start.estimate.force), np.zeros_like(start.estimate.states)
    for index in range(layout.shared):
        step = 1e-6 * np.eye(layout.shared)[index]
        slope = (moved(start, step, no_states, no_force) - moved(start, -step, no_states, no_force)) / 2e-6
        assert equations.gradient[:, index].sum() == pytest.approx(slope, rel=1e-3, abs=1e-2)
    along = np.sign(equations.gradient[:, -2:]) * np.array([1e-8, 1e-6])
    none = np.zeros(layout.shared)
    slope = 0.5 * (moved(start, none, along, no_force) - moved(start, none, -along, no_force))
    assert np.sum(equations.gradient[:, -2:] * along) == pytest.approx(slope, rel=5e-3)


def mode_of_the_force(here: Point) -> np.ndarray:
    """In the linear model, all else held."""
    return estimated_force(here.inner, here.marginal, np.zeros((len(here.at.record), here.prepared.layout.size)))[0]


@pytest.mark.parametrize("damping", [10.0, 1e4])
def test_a_step_that_is_damped_goes_down(start, damping):
    """Though the force is far from its mode; it moves the less, the more it is damped."""
    step = JointMode()._step(start, damping, newton=False)
    assert point(start.prepared, step, start.variances, like=start).cost < start.cost
    whole = np.abs(mode_of_the_force(start) - start.estimate.force).max()
    assert 0.0 < np.abs(step.force - start.estimate.force).max() < 2.0 / damping * whole


def test_a_force_alone_brings_what_is_expected_of_it(start):
    force = mode_of_the_force(start) - start.estimate.force
    fall = start.cost - moved(start, np.zeros(len(start.estimate.shared)), np.zeros_like(start.estimate.states), force)
    assert fall == pytest.approx(start.from_force, rel=0.1)


def test_the_mode_is_reached_and_is_one(start, mode):
    """Nothing is to go there, and from another start it is the same."""
    find = JointMode(most_iterations=40)
    assert find.to_go(mode) < 0.1
    assert mode.cost < start.cost - 100.0
    shared = start.estimate.shared + 1e-3 * np.random.default_rng(3).normal(size=len(start.estimate.shared))
    other = find(point(start.prepared, dataclasses.replace(start.estimate, shared=shared), start.variances))
    assert other.cost == pytest.approx(mode.cost, abs=0.5)
    np.testing.assert_allclose(other.estimate.shared, mode.estimate.shared, atol=1e-3)
