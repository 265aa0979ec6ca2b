"""Which candidates chance would hardly give."""

import pytest

from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.score.scored import best_of_each, score_all, significant, trials
from identification.likelihood.evidence import chance
from tests.identification.diagnosis.made_fit import candidate
from vibrojax.effects import EFFECTS, GainError


def test_only_gains_that_chance_would_hardly_give_are_significant():
    found = [candidate("coulomb_friction", 40.0), candidate("coulomb_friction", 90.0), candidate("gap_drift", 8.0)]
    assert best_of_each(found)["coulomb_friction"].gain == 90.0
    assert list(significant(found)) == ["coulomb_friction"]
    assert chance(8.0, 1, 1) > ALPHA


def test_channels_are_kinds_of_their_own_best_first():
    found = [
        candidate(GainError(factor=1.1, of_channel=name), gain) for name, gain in (("impact_force", 50.0), ("cart_displacement", 60.0))
    ]
    assert list(best_of_each(found)) == ["gain_error cart_displacement", "gain_error impact_force"]


def test_more_trials_of_a_kind_make_its_gain_less_significant():
    many = [candidate("coulomb_friction", 17.0)] + [candidate("coulomb_friction", 0.0)] * 200
    assert (trials(many, "coulomb_friction"), trials(many, "gap_drift")) == (201, 0)
    assert list(significant(many[:1])) == ["coulomb_friction"] and not significant(many)


@pytest.fixture(scope="module")
def beside_friction(motion, friction):
    return score_all(motion.fitted(motion.shown(force=friction(0.05))))


def test_the_effect_that_acts_has_the_largest_expected_gain(beside_friction):
    assert next(iter(beside_friction.significant)) == "coulomb_friction"
    best = beside_friction.found[0]
    assert best.name == "coulomb_friction"
    assert best.factors[0] * float(best.members[0].friction_force) == pytest.approx(0.05, rel=0.1)
    assert {one.name for one in beside_friction.found} <= set(EFFECTS)


def test_beside_a_complete_model_nothing_is_significant(motion):
    assert not score_all(motion.fitted(motion.shown())).significant
