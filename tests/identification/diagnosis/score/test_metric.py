"""Inner products of the full likelihood, against the covariance written out."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from identification.diagnosis.score.metric import metric
from identification.likelihood.joint import Point
from identification.likelihood.random_force import ForceResponse
from tests.identification.likelihood import made_windows as made


def rows_of(at, answer, values, weight):
    """Rows in the metric of made windows."""
    point = Mock(
        Point,
        at=at,
        answer=ForceResponse.whole(at.over_noise(answer, made.NOISE)),
        inner=made.made_grams(at, answer),
        variances=SimpleNamespace(root=made.FORCE.root(made.PLACES), noise=made.NOISE),
        weight=weight,
    )
    return metric(point)(values)


@pytest.mark.parametrize("strength", [0.0, 0.3, 30.0])
def test_inner_products_are_those_over_the_whole_covariance(strength):
    at = made.made_windows(4)
    answer, weight = strength * made.made_answer(at), np.linspace(0.5, 1.5, len(at.record))
    rows = rows_of(at, answer, np.concatenate([at.residual[:, None], at.jacobian], axis=1), weight)
    force = made.force_covariance(made.FORCE)
    expected = np.stack(
        [
            w * one.columns.T @ np.linalg.solve(one.covariance(force), one.columns)
            for w, one in zip(weight, made.dense(at, answer), strict=True)
        ]
    )
    np.testing.assert_allclose(rows.inner(rows), expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())
    assert rows[:1].total(rows[:1]) == pytest.approx(expected[:, 0, 0].sum())


@pytest.mark.parametrize("strength", [1e4, 1e7, 1e10])
def test_a_huge_random_force_leaves_what_is_orthogonal_to_it(strength):
    """Against the limit, the covariance of the noise after regression on the force's response; all norms stay positive."""
    at = made.made_windows(4)
    answer, values = strength * made.made_answer(at), at.jacobian
    rows = rows_of(at, answer, np.concatenate([values, answer[:, :1]], axis=1), np.ones(len(at.record)))
    found = rows.inner(rows)
    assert np.all(np.diagonal(found, axis1=1, axis2=2) > 0.0)
    for window, one in enumerate(made.dense(at, answer)):
        root = np.linalg.cholesky(one.noise)
        white, force = np.linalg.solve(root, one.jacobian), np.linalg.solve(root, one.answer / strength)
        rest = white - force @ np.linalg.lstsq(force, white, rcond=None)[0]
        np.testing.assert_allclose(found[window, :-1, :-1], rest.T @ rest, rtol=0, atol=1e-6 * np.abs(white.T @ white).max())


def test_rows_of_other_windows_are_zero():
    at = made.made_windows(4)
    rows, chosen = rows_of(at, 0.3 * made.made_answer(at), at.jacobian, np.ones(len(at.record))), np.arange(len(at.record)) == 1
    found = rows.restricted_to(chosen).inner(rows)
    np.testing.assert_array_equal(found[~chosen], 0.0)
    np.testing.assert_allclose(found[chosen], rows.inner(rows)[chosen])
