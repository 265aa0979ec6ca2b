"""Limits of the search on request."""

import numpy as np
import pytest

from identification.diagnosis.search.among import among_effects, limits
from identification.diagnosis.search.search import COMPLETE, search
from vibrojax.effects import EFFECTS
from vibrojax.errors import InputError


def test_all_listed_effects_are_looked_for_unless_limited():
    assert among_effects() == tuple(EFFECTS)
    assert limits(EFFECTS) == ()


def test_the_reader_is_told_of_the_limit():
    assert limits(("hysteresis",)) == ("the search was limited on request: nothing but hysteresis could be found",)
    assert limits(among_effects(without=["hysteresis"])) == ("the search was limited on request: hysteresis could not be found",)


def test_no_effect_left_is_refused():
    with pytest.raises(InputError, match="no effect is left to look for"):
        among_effects(only=["hysteresis"], without=["hysteresis"])


def test_an_effect_that_is_excluded_is_not_scored(motion, friction):
    """Dry friction is missing; among others it is neither scored nor added."""
    found = search(motion.fitted(motion.shown(force=friction(0.05))), deadline=np.inf, among=("gain_error",))
    assert found.ended == COMPLETE
    assert {one.name for one in found.first.found} == {"gain_error"}
    assert "coulomb_friction" not in found.fitted.names
