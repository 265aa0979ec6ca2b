"""Limits of the search on request."""

import numpy as np
import pytest

from identification.diagnosis.search.among import ON_REQUEST, SEARCHED, among_effects, limit_warning
from identification.diagnosis.search.forward import COMPLETE, search
from vibrojax.effects import EFFECTS
from vibrojax.errors import InputError


def test_all_effects_but_those_on_request_are_looked_for_unless_limited():
    assert among_effects() == SEARCHED == tuple(name for name in EFFECTS if name not in ON_REQUEST)
    assert ON_REQUEST < set(EFFECTS)
    assert limit_warning(SEARCHED) == limit_warning(tuple(EFFECTS)) == ()


def test_an_effect_on_request_is_looked_for_where_it_is_named():
    assert among_effects(only=["clock_drift", "hysteresis"]) == ("hysteresis", "clock_drift")


def test_the_limit_is_stated():
    assert limit_warning(("hysteresis",)) == ("limited on request: of the listed effects, only hysteresis could be named",)
    assert limit_warning(among_effects(without=["hysteresis"])) == (
        "limited on request: of the listed effects, hysteresis could not be named",
    )


def test_no_effect_left_is_refused():
    with pytest.raises(InputError, match="no effect is left to look for"):
        among_effects(only=["hysteresis"], without=["hysteresis"])


def test_every_name_is_listed_where_none_is_near():
    with pytest.raises(InputError, match="expected one of coulomb_friction.*asymmetric_damping"):
        among_effects(only=["Stiction, I think"])


def test_one_text_is_no_list_of_names():
    with pytest.raises(InputError, match=r"expected a list of names of effects, such as \['hysteresis'\]"):
        among_effects(only="hysteresis")


def test_an_effect_that_is_excluded_is_not_scored(motion, friction):
    """Dry friction is missing; among others it is neither scored nor added."""
    found = search(motion.fitted(motion.shown(force=friction(0.05))), deadline=np.inf, among=("gain_error",))
    assert found.ended == COMPLETE
    assert {one.name for one in found.first.found} == {"gain_error"}
    assert "coulomb_friction" not in found.fitted.names
