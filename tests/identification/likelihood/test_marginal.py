"""Windows with their random force integrated out, against their covariance written out."""

import dataclasses

import numpy as np
import pytest

from identification.likelihood.marginal import Grams, estimated_force, grams, marginal, without_force
from identification.likelihood.random_force import ForceResponse
from tests.identification.likelihood.made_windows import (
    FORCE,
    NOISE,
    PLACES,
    RECORD,
    dense,
    force_covariance,
    made_answer,
    made_grams,
    made_windows,
)

SIZE = 4
ROUNDING = 1e-13
"""Of sums over the samples of a window, as a share of the largest one; rounding gives 3e-15."""
ROOT = FORCE.root(PLACES)
COVARIANCE = force_covariance(FORCE)


@pytest.fixture(scope="module")
def at():
    return made_windows(SIZE)


@pytest.fixture(scope="module")
def answer(at):
    return 0.3 * made_answer(at)


@pytest.fixture(scope="module")
def textbook(at, answer):
    return dense(at, answer)


@pytest.fixture(scope="module")
def exact(textbook) -> Grams:
    """All inner products, from the covariance written out."""

    def products(left, right):
        return np.stack([getattr(w, left).T @ np.linalg.inv(w.noise) @ getattr(w, right) for w in textbook])

    return Grams(
        fit=products("columns", "columns"),
        force=products("answer", "answer"),
        cross=products("answer", "columns"),
        samples=np.array([len(w.residual) for w in textbook]),
        log_scale=np.array([0.5 * np.linalg.slogdet(w.noise)[1] for w in textbook]),
    )


def close(found, expected, accuracy):
    """Each matrix to a share of its largest number."""
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=accuracy * np.abs(other).max())


def test_inner_products_are_those_over_the_noise(at, answer, exact):
    found = made_grams(at, answer)
    np.testing.assert_allclose(found.fit, exact.fit, rtol=1e-10, atol=1e-9)
    close(found.force, exact.force, ROUNDING)
    close(found.cross, exact.cross, ROUNDING)
    np.testing.assert_array_equal(found.samples, exact.samples)
    np.testing.assert_allclose(found.log_scale, exact.log_scale, rtol=1e-10)


def test_known_products_of_the_answer_are_taken(at, answer, exact):
    found = grams(at, ForceResponse.whole(np.moveaxis(made_answer(at), -1, -2)), NOISE, exact.force)
    np.testing.assert_array_equal(found.force, exact.force)


def test_marginal_is_that_of_the_whole_covariance(exact, textbook):
    """X' V^-1 X and log |V| - log |R|."""
    found = marginal(exact, ROOT)
    for window, one in enumerate(textbook):
        covariance = one.covariance(COVARIANCE)
        expected = one.columns.T @ np.linalg.inv(covariance) @ one.columns
        np.testing.assert_allclose(found.gram[window], expected, rtol=1e-9, atol=1e-9)
        determinant = np.linalg.slogdet(covariance)[1] - np.linalg.slogdet(one.noise)[1]
        assert found.log_determinant[window] == pytest.approx(determinant, rel=1e-10)
    np.testing.assert_array_equal(found.deviation, found.gram[:, 0, 0])


def test_a_diverged_window_leaves_the_others_as_they_are(exact):
    """Its inner products are beyond what rounding leaves of the unit matrix."""
    rng, knots = np.random.default_rng(0), len(ROOT)
    answer = rng.normal(size=(knots, 3)) * np.exp(3.0 * rng.normal(size=(knots, 1)))
    huge = 1e20 * answer @ answer.T / np.abs(answer @ answer.T).max()
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(np.eye(knots) + ROOT.T @ huge @ ROOT)
    found = marginal(dataclasses.replace(exact, force=np.concatenate([exact.force[:-1], huge[None]])), ROOT)
    assert np.all(np.isfinite(found.log_determinant))
    np.testing.assert_allclose(found.log_determinant[:-1], marginal(exact, ROOT).log_determinant[:-1], rtol=1e-12)


def test_a_strong_force_costs_no_precision(at, answer, exact):
    """From records on, for a force that shows ten times as much as the noise."""
    found, expected = (marginal(of, 10.0 * ROOT) for of in (made_grams(at, answer), exact))
    np.testing.assert_allclose(found.log_determinant, expected.log_determinant, rtol=1e-12)
    np.testing.assert_allclose(found.deviation, expected.deviation, rtol=1e-12)


def test_force_is_the_best_linear_prediction(exact, textbook):
    """-S Z' V^-1 (r + J step), with covariance S - S Z' V^-1 Z S."""
    step = np.random.default_rng(4).normal(size=(len(RECORD), SIZE))
    found, root = estimated_force(exact, marginal(exact, ROOT), step)
    for window, one in enumerate(textbook):
        gain = COVARIANCE @ one.answer.T @ np.linalg.inv(one.covariance(COVARIANCE))
        np.testing.assert_allclose(found[window], -gain @ (one.residual + one.jacobian @ step[window]), rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(root[window] @ root[window].T, COVARIANCE - gain @ one.answer @ COVARIANCE, rtol=1e-7, atol=1e-9)


def test_products_without_the_force_are_those_of_the_lowered_residual(at, answer, exact):
    """r - Z f in place of r; what they were made of stays."""
    force = np.random.default_rng(5).normal(size=(len(RECORD), len(PLACES)))
    before = dataclasses.replace(exact, fit=exact.fit.copy(), cross=exact.cross.copy())
    lowered = dense(dataclasses.replace(at, residual=at.residual - np.einsum("lktc,lk->ltc", answer, force)), answer)
    found = without_force(exact, force)
    for window, one in enumerate(lowered):
        inverse = np.linalg.inv(one.noise)
        np.testing.assert_allclose(found.fit[window], one.columns.T @ inverse @ one.columns, rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(found.cross[window], one.answer.T @ inverse @ one.columns, rtol=1e-9, atol=1e-8)
    np.testing.assert_array_equal(found.force, exact.force)
    np.testing.assert_array_equal(exact.fit, before.fit)
    np.testing.assert_array_equal(exact.cross, before.cross)


def test_a_window_that_could_not_be_integrated_counts_for_nothing(at, answer):
    whole = made_grams(at, answer)
    lost = made_grams(dataclasses.replace(at, finite=np.arange(len(RECORD)) != 2), answer)
    for name in ("fit", "force", "cross", "samples", "log_scale"):
        found = getattr(lost, name)
        np.testing.assert_array_equal(found[2], 0)
        np.testing.assert_array_equal(np.delete(found, 2, axis=0), np.delete(getattr(whole, name), 2, axis=0))
    assert marginal(lost, ROOT).log_determinant[2] == 0.0
