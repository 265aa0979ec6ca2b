"""The mode of parameters, states and random force together."""

import dataclasses

import numpy as np
import pytest

from identification.least_squares.fit import fit
from identification.likelihood.fitted import first_point
from identification.likelihood.joint import JointMode, Point, point
from identification.likelihood.marginal import estimated_force
from identification.windows.prepare import prepare
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


@pytest.mark.parametrize("degrees", [5.0, 1e4])
def test_the_mode_is_reached_and_is_one(start, degrees):
    """Nothing is to go there, and from another start it is the same; with few degrees of freedom the loss is not convex."""
    start, find = start.under(dataclasses.replace(start.variances, degrees=degrees)), JointMode(most_iterations=40)
    mode = find(start)
    assert find.to_go(mode) < 0.1
    assert mode.cost < start.cost - 100.0
    shared = start.estimate.shared + 1e-3 * np.random.default_rng(3).normal(size=len(start.estimate.shared))
    other = find(point(start.prepared, dataclasses.replace(start.estimate, shared=shared), start.variances))
    assert other.cost == pytest.approx(mode.cost, abs=0.5)
    np.testing.assert_allclose(other.estimate.shared, mode.estimate.shared, atol=1e-3)


def test_curvature_is_that_of_the_cost(start):
    """By second differences along each parameter, with the force held and few degrees of freedom."""
    few = start.under(dataclasses.replace(start.variances, degrees=5.0))
    none, still = np.zeros_like(few.estimate.states), np.zeros_like(few.estimate.force)
    newton, reweighted = few.equations(1e12, newton=True), few.equations(1e12)
    for index in range(few.prepared.layout.shared):
        step = 1e-5 * np.eye(few.prepared.layout.shared)[index]
        curvature = (moved(few, step, none, still) - 2.0 * few.cost + moved(few, -step, none, still)) / 1e-10
        assert newton.hessian[:, index, index].sum() == pytest.approx(curvature, rel=0.01)
        assert reweighted.hessian[:, index, index].sum() > 1.05 * curvature


def test_what_is_known_of_zeros_counts_once(start):
    """Two standard deviations off in both records, as in the gradient."""
    prepared, records = start.prepared, 2
    layout = dataclasses.replace(prepared.layout, zeros=(("hammer_displacement", 1e-6),))

    def at(zero: float) -> Point:
        nuisances = np.concatenate([start.estimate.nuisances, np.full((records, 1), zero)], axis=1)
        estimate = dataclasses.replace(start.estimate, nuisances=nuisances)
        return point(dataclasses.replace(prepared, layout=layout, start=estimate), estimate, start.variances)

    assert at(2.0).prior - at(0.0).prior == pytest.approx(0.5 * records * 2.0**2)
    slope = (at(2.0 + 1e-3).cost - at(2.0 - 1e-3).cost) / 2e-3
    assert at(2.0).equations(1e12).gradient[:, layout.shared + 3].sum() == pytest.approx(slope, rel=1e-3)
