"""An effect taken into a model: its numbers survive, and are in proportion for the steps of a fit."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.errors import numbers
from identification.discrepancy.prune import without_effect
from identification.discrepancy.refit import extended, windows_of, with_model
from identification.discrepancy.score import Candidate
from tests.identification.discrepancy.made_search import settled
from vibrojax.effects import CoulombFriction, GapStep, QuadraticDrag, SecondMode


@pytest.mark.parametrize("force", [0.03, 9.4e3])
def test_a_parameter_is_in_proportion_whatever_the_size_of_the_rig(motion, force):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=force),))
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index = taken.layout.index("coulomb_friction.friction_force")
    assert abs(taken.start.shared[index]) <= 1.0
    assert taken.layout.physical(taken.start.shared)["coulomb_friction.friction_force"] == pytest.approx(force)


@pytest.mark.parametrize(("velocity", "scale"), [(0.001, 0.05), (0.9, 10.0)])
def test_an_own_state_has_room_for_its_motion_whatever_the_size_of_the_rig(motion, velocity, scale):
    mode = SecondMode(mode_mass=0.02, mode_frequency_hz=21.0, mode_damping_ratio=0.03)
    model = dataclasses.replace(motion.prepared.model, effects=(mode,))
    signs = np.where(np.arange(len(motion.estimate.states)) % 2, 1.0, -1.0)[:, None]
    states = np.concatenate([motion.estimate.states, 1e-5 * signs, velocity * signs], axis=1)
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, states)
    assert [state.scale for state in taken.layout.own_states] == pytest.approx([1e-3, scale])


def test_an_effect_found_earlier_keeps_its_fitted_strength_when_another_one_is_added(motion):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.01),))
    prepared = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index = prepared.layout.index("coulomb_friction.friction_force")
    shared = prepared.start.shared.copy()
    shared[index] *= 20.0
    estimate = dataclasses.replace(prepared.start, shared=shared)
    found = settled(prepared, estimate, np.zeros(len(prepared.record)))
    drag = Candidate(members=(QuadraticDrag(drag_coefficient=1e-3),), factors=np.array([3.0]), gain=1.0, degrees=1)
    taken = extended(found, drag, motion.courses)
    start = taken.layout.physical(taken.start.shared)
    assert start["coulomb_friction.friction_force"] == pytest.approx(0.2)
    assert start["quadratic_drag.drag_coefficient"] == pytest.approx(3e-3)
    assert taken.model.values()["coulomb_friction.friction_force"] == pytest.approx(0.2)


@pytest.mark.parametrize("free", [False, True])
def test_an_instant_that_was_set_free_stays_so_whatever_is_added_or_taken_out(motion, free):
    jump = Candidate(members=(GapStep(gap_jump=1e-4, instant=0.3),), factors=np.ones(1), gain=1.0, degrees=1)
    drag = Candidate(members=(QuadraticDrag(drag_coefficient=1e-3),), factors=np.ones(1), gain=1.0, degrees=1)
    taken = extended(settled(motion.prepared, motion.estimate, np.zeros(len(motion.prepared.record))), jump, motion.courses)
    assert taken.fixed["gap_step.instant"] == 0.3
    taken = dataclasses.replace(taken, fixed={} if free else taken.fixed)
    both = extended(settled(taken, taken.start, np.zeros(len(taken.record))), drag, motion.courses)
    alone = without_effect(settled(both, both.start, np.zeros(len(both.record))), "quadratic_drag").prepared
    assert [("gap_step.instant" in one.fixed) for one in (both, alone)] == [not free] * 2


def test_an_instant_is_told_no_better_than_its_equation_says_when(motion, allowed):
    jump = Candidate(members=(GapStep(gap_jump=1e-4, instant=0.3),), factors=np.ones(1), gain=1.0, degrees=1)
    taken = extended(settled(motion.prepared, motion.estimate, np.zeros(len(motion.prepared.record))), jump, motion.courses)
    found = settled(dataclasses.replace(taken, fixed={}), taken.start, 0.5 * allowed.samples)
    size = taken.layout.size
    told = dataclasses.replace(found.outcome.equations, hessian=np.tile(1e8 * np.eye(size), (len(taken.record), 1, 1)))
    found = dataclasses.replace(found, outcome=dataclasses.replace(found.outcome, equations=told))
    by_name = {one.name: one.stderr for one in numbers(found, allowed)}
    assert by_name["gap_step.gap_jump"] < 1e-8
    assert by_name["gap_step.instant"] == pytest.approx(1e-3 / 12**0.5, rel=0.01)


def test_windows_may_be_taken_more_than_once(motion):
    """As many as there are, but not the same."""
    prepared = motion.prepared
    count = len(prepared.record)
    repeated = windows_of(prepared, np.repeat([1], count))
    assert np.array_equal(repeated.start.states, np.tile(prepared.start.states[1], (count, 1)))
    assert windows_of(prepared, np.arange(count)) is prepared
