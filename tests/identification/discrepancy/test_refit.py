"""An effect taken into a model: its numbers survive, and are in proportion for the steps of a fit."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.refit import extended, with_model
from identification.discrepancy.score import Candidate
from tests.identification.discrepancy.made_search import settled
from vibrojax.effects import CoulombFriction, QuadraticDrag


@pytest.mark.parametrize("force", [0.03, 9.4e3])
def test_a_parameter_is_in_proportion_whatever_the_size_of_the_rig(motion, force):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=force),))
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index = taken.layout.index("coulomb_friction.friction_force")
    assert abs(taken.start.shared[index]) <= 1.0
    assert taken.layout.physical(taken.start.shared)["coulomb_friction.friction_force"] == pytest.approx(force)


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
