"""A mode that the motion does not drive stands in for a force from elsewhere."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.driven import rings_by_itself
from identification.discrepancy.refit import extended
from identification.discrepancy.score import Candidate
from tests.identification.discrepancy.made_search import fitted, settled
from vibrojax.effects import CoulombFriction, Hysteresis, SecondMode

MODE = SecondMode(mode_mass=0.02, mode_frequency_hz=30.0, mode_damping_ratio=0.02)
YIELDING = Hysteresis(hysteresis_force=0.1, yield_displacement=1e-3)


@pytest.mark.parametrize(
    ("effect", "times", "by_itself"),
    [(MODE, 1.0, False), (MODE, 2.0, False), (MODE, 4.0, True), (YIELDING, 4.0, False), (CoulombFriction(friction_force=0.1), 1.0, False)],
)
def test_states_are_compared_with_those_that_the_motion_drives(motion, allowed, effect, times, by_itself):
    """From rest at the start of a record; what does not vibrate, or remembers nothing, is not asked."""
    before = fitted(motion, 0.5 * allowed.samples.astype(float))
    candidate = Candidate(members=(effect,), factors=np.ones(1), gain=100.0, degrees=1)
    prepared = extended(before, candidate, motion.courses)
    own = len(effect.own_states)
    states = prepared.start.states * np.r_[np.ones(prepared.start.states.shape[1] - own), np.full(own, times)]
    after = settled(prepared, dataclasses.replace(prepared.start, states=states), before.outcome.equations.cost)
    assert rings_by_itself(after, motion.courses) is by_itself


def test_windows_that_are_lost_say_nothing(motion, allowed):
    """Their states are arbitrary."""
    before = fitted(motion, 0.5 * allowed.samples.astype(float))
    prepared = extended(before, Candidate(members=(MODE,), factors=np.ones(1), gain=100.0, degrees=1), motion.courses)
    states, cost = prepared.start.states.copy(), before.outcome.equations.cost.copy()
    states[5, -2:], cost[5] = 1e3, np.inf
    assert not rings_by_itself(settled(prepared, dataclasses.replace(prepared.start, states=states), cost), motion.courses)
    cost[5] = cost[4]
    assert rings_by_itself(settled(prepared, dataclasses.replace(prepared.start, states=states), cost), motion.courses)
