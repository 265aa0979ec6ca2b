"""An effect taken into a model: its numbers survive, and are in proportion for the steps of a fit."""

import dataclasses

import pytest

from identification.discrepancy.refit import with_model
from vibrojax.effects import CoulombFriction


@pytest.mark.parametrize("force", [0.03, 9.4e3])
def test_a_parameter_is_in_proportion_whatever_the_size_of_the_rig(motion, force):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=force),))
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index = taken.layout.index("coulomb_friction.friction_force")
    assert abs(taken.start.shared[index]) <= 1.0
    assert taken.layout.physical(taken.start.shared)["coulomb_friction.friction_force"] == pytest.approx(force)
