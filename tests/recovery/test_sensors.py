"""Effects of the sensors and the actuator are named, each in a small rig that conceals it."""

import pytest

from tests.recovery.concealed import RIGID, SENSORS, STOP_AND_CART, SUSPENSION, assert_recovered
from vibrojax.effects import EFFECTS


@pytest.mark.thorough
@pytest.mark.parametrize("name", SENSORS)
def test_the_effect_is_named_alone(name, tmp_path):
    assert_recovered(name, tmp_path)


def test_every_effect_that_is_looked_for_is_among_those_recovered():
    assert sorted((*SUSPENSION, *STOP_AND_CART, *SENSORS, *RIGID)) == sorted(EFFECTS)
