"""An effect that remembers carries on from window to window; one whose memory is chosen anew in every window pays for it."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.continuity import continuity_cost
from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.signature import own_states
from identification.fit import evaluator, integrator_for
from identification.levenberg_marquardt import Outcome
from vibrojax.effects.hysteresis import Hysteresis


@pytest.fixture(scope="module")
def remembering(motion):
    """The example with hysteresis, its state in every window as the motion leaves it, or with something added."""
    effect = Hysteresis(0.01, 5e-4)
    along = own_states(effect, motion.courses)
    memory = np.array([along[record][first, 0] for record, first in zip(motion.at.record, motion.at.first, strict=True)])
    model = dataclasses.replace(motion.prepared.model.replace(motion.prepared.layout.physical(motion.estimate.shared)), effects=(effect,))

    def fitted(added: np.ndarray | float) -> Fitted:
        states = np.concatenate([motion.estimate.states, (memory + added)[:, None]], axis=1)
        prepared = with_model(motion.prepared, model, motion.estimate.nuisances, states)
        equations = evaluator(prepared, integrator_for(prepared))(prepared.start)
        outcome = Outcome(estimate=prepared.start, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
        return Fitted(prepared=prepared, outcome=outcome)

    return fitted


def test_memory_that_carries_on_costs_little_and_memory_chosen_anew_costs_much(motion, remembering):
    windows = len(motion.at.record)
    honest = continuity_cost(remembering(0.0))
    assert honest < 0.05 * windows
    scattered = continuity_cost(remembering(0.5 * np.random.default_rng(2).standard_normal(windows)))
    assert scattered > 0.5 * windows


def test_a_model_without_memory_costs_nothing(motion):
    equations = evaluator(motion.prepared, integrator_for(motion.prepared))(motion.estimate)
    outcome = Outcome(estimate=motion.estimate, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
    assert continuity_cost(Fitted(prepared=motion.prepared, outcome=outcome)) == 0.0
