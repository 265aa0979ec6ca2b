"""Expected gains with the random force estimated anew."""

import numpy as np
import pytest

from identification.diagnosis.score.profiled import change_of, profiled_gains
from identification.diagnosis.score.score import projector, score
from identification.diagnosis.score.scored import score_all
from identification.likelihood.random_force import RandomForce
from vibrojax.effects import CoulombFriction

SIZE = 0.02
"""N: of the friction that acts."""


@pytest.fixture(scope="module")
def taken_up(motion, friction):
    """Where a random force of the size of the friction has taken its place."""
    return motion.fitted(motion.shown(force=friction(SIZE)), force=RandomForce(std=2.0 * SIZE, memory=0.02))


def score_gain(motion, fitted, effect):
    (found,) = score(fitted.prepared, projector(fitted), motion.courses, [(effect,)], motion.mass)
    return found


def test_without_a_random_force_it_is_the_score_test(motion, friction):
    fitted = motion.fitted(motion.shown(force=friction(SIZE)))
    tested = score_gain(motion, fitted, CoulombFriction(0.01))
    (gain,) = profiled_gains(fitted, change_of(fitted, tested, motion.courses)[:, None], np.array([True]))
    assert gain == pytest.approx(tested.gain, rel=1e-4)
    assert tested.gain > 100.0


def test_what_a_random_force_has_taken_up_is_given_back(motion, taken_up):
    """The score test holds the force and expects little; with the effect in its place the force is nearly nothing."""
    tested = score_gain(motion, taken_up, CoulombFriction(0.01))
    best = next(one for one in score_all(taken_up).found if one.name == "coulomb_friction")
    assert best.gain > 1.5 * tested.gain > 0.0


def test_the_wrong_direction_gains_nothing(motion, taken_up):
    change = change_of(taken_up, score_gain(motion, taken_up, CoulombFriction(0.01)), motion.courses)[:, None]
    one_sided, either = (profiled_gains(taken_up, -change, np.array([flag]))[0] for flag in (True, False))
    assert one_sided == 0.0 < either


def test_a_force_larger_than_the_records_show_makes_nothing_significant(motion):
    assert not score_all(motion.fitted(motion.shown(), force=RandomForce(std=0.5, memory=0.02))).significant
