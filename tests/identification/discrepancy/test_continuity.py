"""An effect that remembers carries on from window to window; one whose memory is chosen anew in every window pays for it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from identification.discrepancy.continuity import continuity_cost
from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.signature import own_states
from identification.fit import as_arrays, evaluator, integrator_for, on_device
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


def test_a_model_without_memory_costs_nothing(motion):
    equations = evaluator(motion.prepared, integrator_for(motion.prepared))(motion.estimate)
    outcome = Outcome(estimate=motion.estimate, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
    assert continuity_cost(Fitted(prepared=motion.prepared, outcome=outcome)) == 0.0
