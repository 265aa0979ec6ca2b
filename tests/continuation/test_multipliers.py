"""Tests that vanish where an orbit changes its stability, on matrices with known eigenvalues."""

import numpy as np
import pytest

from vibrojax.continuation.orbit import flip_test, fold_test, has_unit_pair, is_stable, multipliers, torus_test


def matrix(*values: complex) -> np.ndarray:
    """Real matrix with these eigenvalues, one of each complex pair given, in a skew basis."""
    blocks = [np.array([[v.real, v.imag], [-v.imag, v.real]]) if complex(v).imag else np.array([[complex(v).real]]) for v in values]
    size = sum(len(block) for block in blocks)
    full, begin = np.zeros((size, size)), 0
    for block in blocks:
        full[begin : begin + len(block), begin : begin + len(block)] = block
        begin += len(block)
    basis = np.eye(size) + np.triu(np.full((size, size), 0.3), 1)
    return basis @ full @ np.linalg.inv(basis)


@pytest.mark.parametrize(
    ("test", "inside", "outside"),
    [(fold_test, (0.9, 0.2), (1.1, 0.2)), (flip_test, (-0.9, 0.2), (-1.1, 0.2)), (torus_test, (0.6 + 0.7j, 0.2), (0.8 + 0.7j, 0.2))],
)
def test_each_test_changes_sign_at_its_own_crossing_only(test, inside, outside):
    assert test(matrix(*inside)) * test(matrix(*outside)) < 0
    for other in {fold_test, flip_test, torus_test} - {test}:
        assert other(matrix(*inside)) * other(matrix(*outside)) > 0


def test_a_torus_needs_a_complex_pair():
    on_circle = np.exp(0.7j)
    assert has_unit_pair(multipliers(matrix(on_circle, 0.1)), 1e-6)
    assert torus_test(matrix(on_circle, 0.1)) == pytest.approx(0.0, abs=1e-12)
    neutral_saddle = matrix(2.0, 0.5)
    assert torus_test(neutral_saddle) == pytest.approx(0.0, abs=1e-12)
    assert not has_unit_pair(multipliers(neutral_saddle), 1e-6)


def test_stability_is_stated_point_by_point():
    assert is_stable(np.array([[0.5 + 0j, -0.9], [0.5, -1.1]])).tolist() == [True, False]
