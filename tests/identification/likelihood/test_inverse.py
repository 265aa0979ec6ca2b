"""The inverse of the derivative of the state, through windows that die down and stretch."""

import numpy as np
import pytest

from identification.likelihood.linearised import _inverse


def inverted(*matrices: np.ndarray) -> np.ndarray:
    """Of one window whose derivative is 1 at its begin, has elements of the same size soon, and becomes these after it."""
    states = len(matrices[0])
    return _inverse(np.stack([np.eye(states), np.ones((states, states)), *matrices])[None], np.array([True]))[0, 2:]


@pytest.mark.parametrize("size", [1e-30, 1e-8, 1.0, 1e8])
@pytest.mark.parametrize("states", [2, 3, 4])
def test_what_dies_down_or_grows_as_a_whole_is_inverted(states, size):
    matrix = size * np.random.default_rng(states).normal(size=(states, states))
    np.testing.assert_allclose(inverted(matrix)[0] @ matrix, np.eye(states), atol=1e-9)


@pytest.mark.parametrize("small", [1e-3, 1e-6, 1e-7, 1e-9])
@pytest.mark.parametrize("states", [2, 3])
def test_what_impacts_have_stretched_is_inverted(states, small):
    matrix = np.diag([1.0, *[small] * (states - 1)])
    np.testing.assert_allclose(inverted(matrix)[0], np.diag([1.0, *[1.0 / small] * (states - 1)]), rtol=1e-6)


def test_a_state_that_no_longer_matters_is_left_out():
    """The derivative in its initial value is rounding error; the others are inverted as if it were not there."""
    matrix = np.array([[2.0, 1.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1e-15]])
    expected = np.zeros((3, 3))
    expected[:2, :2] = np.linalg.inv(matrix[:2, :2])
    np.testing.assert_allclose(inverted(matrix)[0], expected, atol=1e-12)
