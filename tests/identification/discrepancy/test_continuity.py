"""An effect that remembers carries on from window to window; one whose memory is chosen anew in every window pays for it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from identification.block_arrow import GAP_PRIOR_STD, columns
from identification.discrepancy.continuity import apart, continuity_cost, states_cost, states_margin, whole_cost
from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.signature import own_states
from identification.fit import as_arrays, evaluator, fit, free_unknowns, integrator_for, on_device
from identification.levenberg_marquardt import Outcome
from identification.residual import predict
from vibrojax.effects import AbstractEffect
from vibrojax.effects.hysteresis import Hysteresis
from vibrojax.effects.stop_compliance import StopCompliance


@pytest.fixture(scope="module")
def remembering(motion):
    """The example with an effect, its states in every window as the motion leaves them, or with something added."""

    def fitted(effect: AbstractEffect, added: np.ndarray | float = 0.0) -> Fitted:
        along = own_states(effect, motion.courses)
        memory = np.array([along[record][first] for record, first in zip(motion.at.record, motion.at.first, strict=True)])
        nominal = motion.prepared.model.replace(motion.prepared.layout.physical(motion.estimate.shared))
        model = dataclasses.replace(nominal, effects=(effect,))
        states = np.concatenate([motion.estimate.states, memory + added], axis=1)
        prepared = with_model(motion.prepared, model, motion.estimate.nuisances, states)
        equations = evaluator(prepared, integrator_for(prepared))(prepared.start)
        outcome = Outcome(estimate=prepared.start, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
        return Fitted(prepared=prepared, outcome=outcome)

    return fitted


def test_memory_that_carries_on_costs_little(motion, remembering):
    assert continuity_cost(remembering(Hysteresis(0.01, 5e-4))) < 0.05 * len(motion.at.record)


def test_memory_is_carried_to_where_the_next_window_begins(remembering):
    """Not extrapolated to it: a stop may ring at a tenth of the sampling rate. Compared with windows that go on for twenty samples."""
    fitted = remembering(StopCompliance(1e6, 400.0, 5e-3))
    prepared, layout = fitted.prepared, fitted.prepared.layout
    (group,) = prepared.groups
    lanes = np.flatnonzero(group.lengths + 20 <= group.ts.shape[1])
    assert len(lanes)
    longer = on_device(jax.tree.map(lambda leaf: leaf[lanes], dataclasses.replace(group, lengths=group.lengths + 20)))
    local = jnp.asarray(prepared.start.local(prepared.record)[lanes])
    _, trajectory = predict(as_arrays(prepared.model), layout, integrator_for(prepared), longer, local)
    there = np.asarray(trajectory.own)[np.arange(len(lanes)), group.lengths[lanes]]
    size = np.abs(there).max(axis=0)
    assert np.all(size > 0)
    assert np.all(np.abs(fitted.outcome.equations.onward[lanes, 2:] - there) < 0.02 * size)


def test_memory_chosen_anew_costs_much(motion, remembering):
    windows = len(motion.at.record)
    scattered = 0.5 * np.random.default_rng(2).standard_normal((windows, 1))
    assert continuity_cost(remembering(Hysteresis(0.01, 5e-4), scattered)) > 0.5 * windows


@pytest.fixture(scope="module")
def held(remembering):
    """The example with hysteresis whose state has this scale."""
    free = remembering(Hysteresis(0.01, 5e-4))
    (state,) = free.prepared.layout.own_states

    def fitted(scale: float) -> Fitted:
        layout = dataclasses.replace(free.prepared.layout, own_states=(dataclasses.replace(state, scale=scale),))
        prepared = dataclasses.replace(free.prepared, layout=layout)
        equations = evaluator(prepared, integrator_for(prepared))(prepared.start)
        return Fitted(prepared=prepared, outcome=dataclasses.replace(free.outcome, equations=equations))

    return fitted


def test_free_memory_costs_what_noise_gains_by_it_and_none_where_a_prior_holds_it(motion, held):
    windows, small = len(motion.at.record), 1e-6
    assert 0.95 * 0.5 * windows < states_cost(held(1e3)) <= 0.5 * windows
    assert 0.95 * 3.0 * np.sqrt(0.5 * windows) < states_margin(held(1e3)) <= 3.0 * np.sqrt(0.5 * windows)
    assert states_cost(held(small)) - continuity_cost(held(small)) < 1e-3 * windows
    assert states_margin(held(small)) < 1e-3 * states_margin(held(1e3))


def test_noise_gains_what_is_said_by_memory_that_is_half_determined(motion, held):
    """Drawn: the best z under data of the precision h and a prior of the precision 1 / s^2 gains g^2 / 2 (h + 1 / s^2), g ~ N(0, h)."""
    fitted = held(0.5)
    precision = _determined_alone(fitted)
    share = precision / (precision + 0.5**-2)
    assert 0.1 < share.mean() < 0.9
    drawn = 0.5 * np.random.default_rng(3).standard_normal((20_000, len(share))) ** 2 @ share
    assert states_cost(fitted) == pytest.approx(drawn.mean(), rel=0.02)
    assert states_margin(fitted) == pytest.approx(3.0 * drawn.std(), rel=0.02)


def _determined_alone(fitted: Fitted) -> np.ndarray:
    """(windows,): what each window's data say of its z with u and u' free, by the Schur complement of its own Hessian less the prior."""
    block = fitted.outcome.equations.hessian[:, -3:, -3:]
    motion = np.linalg.solve(block[:, :2, :2], block[:, :2, 2:])
    return (block[:, 2:, 2:] - block[:, 2:, :2] @ motion)[:, 0, 0] - 0.5**-2


def test_each_of_two_states_counts(motion, remembering):
    one, two = remembering(Hysteresis(0.01, 5e-4)), remembering(StopCompliance(1e6, 400.0, 5e-3))
    assert len(two.prepared.layout.free_own) == 2
    assert states_cost(two) > 1.2 * states_cost(one)


def test_the_whole_cost_holds_the_price_of_states(allowed, held):
    fitted = held(1.0)
    assert whole_cost(fitted, allowed) == allowed.total(fitted.outcome.equations.cost) + states_cost(fitted)


def test_a_model_without_memory_costs_nothing(motion):
    equations = evaluator(motion.prepared, integrator_for(motion.prepared))(motion.estimate)
    outcome = Outcome(estimate=motion.estimate, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
    fitted = Fitted(prepared=motion.prepared, outcome=outcome)
    assert continuity_cost(fitted) == states_cost(fitted) == states_margin(fitted) == 0.0


def test_the_derivatives_of_a_windows_end_are_those_of_its_difference(remembering):
    fitted = remembering(StopCompliance(1e6, 400.0, 5e-3))
    start, equations = fitted.prepared.start, fitted.outcome.equations
    evaluate, layout = evaluator(fitted.prepared, integrator_for(fitted.prepared)), fitted.prepared.layout
    for column, step in ((1, 1e-6), (3, 1e-6)):
        states = start.states.copy()
        states[:, column] += step
        moved = (evaluate(dataclasses.replace(start, states=states)).onward - equations.onward) / step
        there = equations.onward_jacobian[:, :, layout.size - layout.states + column]
        np.testing.assert_allclose(moved, there, rtol=0.02, atol=1e-3 * np.abs(there).max())


def test_it_is_the_rise_of_the_cost_when_all_is_free_and_windows_join(remembering):
    """Of the quadratic approximation with every unknown in one matrix; each jump has its pull, and parameters may follow."""
    fitted = remembering(Hysteresis(0.01, 5e-4), 0.05 * np.random.default_rng(3).standard_normal((1, 1)))
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    equations = dataclasses.replace(fitted.outcome.equations, cost=np.ones(len(prepared.record)))  # none astray
    fitted = dataclasses.replace(fitted, outcome=dataclasses.replace(fitted.outcome, equations=equations))
    active, states = free_unknowns(prepared), prepared.layout.states
    place = columns(estimate, equations.record)
    unknowns = active.shared.size + active.nuisances.size
    size = unknowns + states * len(place)
    local = np.concatenate([place, unknowns + states * np.arange(len(place))[:, None] + np.arange(states)], axis=1)
    hessian, free = np.zeros((size, size)), np.concatenate([active.shared, active.nuisances.ravel(), np.ones(size - unknowns, bool)])
    np.add.at(hessian, (local[:, :, None], local[:, None, :]), equations.hessian)
    gaps = active.shared.size + active.nuisances.shape[1] * np.arange(len(active.nuisances)) + 2
    hessian[gaps, gaps] += GAP_PRIOR_STD**-2
    first = np.concatenate([group.first for group in prepared.groups])
    ends = {
        (r, b): w
        for w, (r, b) in enumerate(zip(prepared.record, first + np.concatenate([g.lengths for g in prepared.groups]), strict=True))
    }
    pairs = [(ends[key], right) for right, key in enumerate(zip(prepared.record, first, strict=True)) if key in ends]
    slope = np.zeros((len(pairs), size))
    for row, (left, right) in enumerate(pairs):
        slope[row, local[right, -1]] += 1.0
        slope[row, local[left]] -= equations.onward_jacobian[left, 2]
    jump = np.array([estimate.states[right, 2] - equations.onward[left, 2] for left, right in pairs])
    scale = 1.0 / np.sqrt(np.diag(hessian)[free])
    inverse = np.linalg.pinv(hessian[np.ix_(free, free)] * np.outer(scale, scale), rcond=1e-12, hermitian=True) * np.outer(scale, scale)
    rise = 0.5 * jump @ np.linalg.pinv(slope[:, free] @ inverse @ slope[:, free].T, rcond=1e-12, hermitian=True) @ jump
    assert continuity_cost(fitted) == pytest.approx(rise * len(place) / len(pairs), rel=1e-3)
    assert rise > 1.0


def test_windows_that_a_slow_force_bends_apart_are_told_though_each_fits(motion):
    """Each window begins where its own record has it; one that is moved in the end by what the model lacks does not meet the next."""
    complete = Fitted(prepared=motion.prepared, outcome=fit(motion.prepared))
    equations = complete.outcome.equations
    drift = 1e-4 * np.where(np.arange(len(motion.at.record)) % 2, 1.0, -1.0)[:, None] * [1.0, 0.0]
    moved = dataclasses.replace(complete.outcome, equations=dataclasses.replace(equations, onward=equations.onward + drift))
    assert 0.5 < apart(complete) < 2.0
    assert apart(Fitted(prepared=motion.prepared, outcome=moved)) > 200.0
