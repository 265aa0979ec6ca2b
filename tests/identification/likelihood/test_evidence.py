"""Chances and criteria against the distributions and densities that they stand for."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from identification.likelihood.evidence import chance, chance_of_force, criterion


@pytest.mark.parametrize(("gain", "degrees", "trials"), [(12.0, 1, 1), (12.0, 1, 10), (30.0, 4, 25), (80.0, 2, 1000)])
def test_chance_is_that_of_chi_square_in_as_many_trials(gain, degrees, trials):
    assert chance(gain, degrees, trials) == pytest.approx(trials * chi2(degrees).sf(gain), rel=1e-10)


def test_chance_bounds_that_of_the_best_of_independent_trials():
    """1 - (1 - p)^m, from above, and little more where it is small."""
    for gain in (5.0, 15.0, 30.0):
        best = -np.expm1(10 * np.log1p(-chi2(1).sf(gain)))
        assert best <= chance(gain, 1, 10)
    assert chance(30.0, 1, 10) == pytest.approx(best, rel=1e-4)


def test_chance_never_exceeds_one():
    assert chance(0.5, 1, 50) == 1.0
    assert chance(-3.0, 1, 1) == 1.0


def test_an_effect_without_numbers_counts_as_one_with_one():
    assert chance(9.0, 0, 3) == chance(9.0, 1, 3)


@pytest.mark.parametrize("gain", [0.5, 2.706, 10.0, 60.0])
def test_chance_of_a_force_is_one_sided(gain):
    """Twice the log-likelihood rises by max(z, 0)^2, z standard normal: beyond the gain where z is beyond its root."""
    assert chance_of_force(gain) == pytest.approx(norm.sf(np.sqrt(gain)), rel=1e-9)


@pytest.mark.parametrize("gain", [0.0, -1.0])
def test_no_gain_is_no_force(gain):
    assert chance_of_force(gain) == 1.0


def test_criterion_prefers_the_line_as_the_textbook_does():
    """n ln(RSS / n) + k ln n of two regressions differs by as much."""
    rng, x = np.random.default_rng(0), np.linspace(-1.0, 1.0, 50)
    y = 1.0 + 0.2 * x + 0.3 * rng.standard_normal(50)
    textbook, found = [], []
    for columns in (1, 2, 5):
        design = np.vander(x, columns)
        rest = y - design @ np.linalg.lstsq(design, y)[0]
        std = np.sqrt(np.mean(rest**2))
        textbook.append(50 * np.log(std**2) + columns * np.log(50))
        found.append(criterion(float(norm(scale=std).logpdf(rest).sum()), columns, 50))
    np.testing.assert_allclose(np.diff(found), np.diff(textbook), rtol=1e-9)
