"""Effects of the suspension are named, each in a small rig that conceals it."""

import pytest

from tests.recovery.concealed import SUSPENSION, assert_recovered


@pytest.mark.thorough
@pytest.mark.parametrize("name", SUSPENSION)
def test_the_effect_is_named_alone(name, tmp_path):
    assert_recovered(name, tmp_path)
