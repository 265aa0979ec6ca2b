"""Effects of the stop and the cart are named, each in a small rig that conceals it."""

import pytest

from tests.recovery.concealed import STOP_AND_CART, assert_recovered


@pytest.mark.thorough
@pytest.mark.parametrize("name", STOP_AND_CART)
def test_the_effect_is_named_alone(name, tmp_path):
    assert_recovered(name, tmp_path)
