"""A mode that the motion does not drive stands in for a force from elsewhere."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.driven import rings_by_itself
from identification.discrepancy.refit import extended, windows_of
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


def _with_own_states(motion, allowed, changed) -> bool:
    """Whether the mode is told to ring by itself with its states as `changed`, (windows, own) before and after, has them."""
    before = fitted(motion, 0.5 * allowed.samples.astype(float))
    prepared = extended(before, Candidate(members=(MODE,), factors=np.ones(1), gain=100.0, degrees=1), motion.courses)
    states = prepared.start.states.copy()
    states[:, -2:] = changed(states[:, -2:])
    after = settled(prepared, dataclasses.replace(prepared.start, states=states), before.outcome.equations.cost)
    return rings_by_itself(after, motion.courses)


def test_states_as_large_as_the_driven_ones_but_of_another_time_ring_by_themselves(motion, allowed):
    """As those by which windows follow what random forces do, and as those that go against the motion."""
    assert _with_own_states(motion, allowed, lambda own: np.random.default_rng(3).permutation(own))
    assert _with_own_states(motion, allowed, np.negative)


def test_a_driven_mode_is_told_from_one_that_is_not_under_noise(motion, allowed):
    """Larger than what the motion drives, which leaves them nearer to that than to rest nevertheless."""
    noise = np.random.default_rng(4).standard_normal((len(allowed.samples), 2))

    def noisy(own: np.ndarray) -> np.ndarray:
        return own + 1.2 * noise * np.sqrt(np.mean(own**2, axis=0))

    assert not _with_own_states(motion, allowed, noisy)
    assert _with_own_states(motion, allowed, lambda own: noisy(own) - own)


def test_what_a_record_begins_with_was_driven_before_it(motion, allowed):
    """Of records that are one window each, as those of a shock, the rest tells nothing."""
    before = fitted(motion, 0.5 * allowed.samples.astype(float))
    prepared = extended(before, Candidate(members=(MODE,), factors=np.ones(1), gain=100.0, degrees=1), motion.courses)
    first = np.concatenate([group.first for group in prepared.groups])
    size = np.sqrt(np.mean(prepared.start.states[:, -2:] ** 2, axis=0))
    for chosen, by_itself in ((first == 0, False), (first > 0, True)):
        part = windows_of(prepared, np.flatnonzero(chosen))
        states = part.start.states.copy()
        states[:, -2:] = np.random.default_rng(5).choice([-0.5, 0.5], (len(states), 2)) * size
        after = settled(part, dataclasses.replace(part.start, states=states), before.outcome.equations.cost[chosen])
        assert rings_by_itself(after, motion.courses) is by_itself


def test_where_every_window_is_lost_nothing_is_told(motion, allowed):
    """Their states say nothing."""
    before = fitted(motion, np.full(len(allowed.samples), np.inf))
    prepared = extended(before, Candidate(members=(MODE,), factors=np.ones(1), gain=100.0, degrees=1), motion.courses)
    assert not rings_by_itself(settled(prepared, prepared.start, before.outcome.equations.cost), motion.courses)
