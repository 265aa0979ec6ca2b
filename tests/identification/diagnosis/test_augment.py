"""Where models with an effect begin."""

import dataclasses

import numpy as np

from identification.diagnosis.augment import extended, strengthened, without
from tests.effects.start import at_start
from tests.identification.diagnosis.test_signals import probed
from vibrojax.effects import EFFECTS, BackStop


def test_a_model_with_an_effect_begins_at_the_measured_trajectory_and_at_the_estimate_without_it(seen):
    moved = dataclasses.replace(seen.fitted.at, states=1.01 * seen.fitted.at.states)
    beside = dataclasses.replace(seen, fitted=dataclasses.replace(seen.fitted, at=moved))
    problem, near = extended(beside, probed(seen, "quadratic_drag"), np.ones(1))
    np.testing.assert_array_equal(problem.start.states, seen.fitted.problem.start.states)
    np.testing.assert_array_equal(near.states, moved.states)
    assert len(near.shared) == len(seen.fitted.at.shared) + 1


def test_an_effect_that_is_left_out_leaves_the_measured_trajectory_as_it_was(seen):
    problem, near = extended(seen, probed(seen, "quadratic_drag"), np.ones(1))
    with_it = dataclasses.replace(seen.fitted, problem=problem, at=near)
    again, estimate = without(with_it, "quadratic_drag")
    np.testing.assert_array_equal(again.start.states, seen.fitted.problem.start.states)
    np.testing.assert_allclose(estimate.shared, seen.fitted.at.shared, rtol=1e-12)


def test_a_stop_begins_at_its_place_whatever_its_first_order_says():
    stop = BackStop(0.007)
    assert strengthened((stop,), np.array([-0.3])) == (stop, {})


def test_the_strength_of_a_loss_goes_with_its_estimate():
    drag = at_start(EFFECTS["quadratic_drag"])
    (found, own) = strengthened((drag,), np.array([2.0]))
    assert found.drag_coefficient == 2.0 * drag.drag_coefficient
    assert not own
