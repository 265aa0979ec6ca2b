"""Chances against the distributions that they stand for."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from identification.result.evidence import chance, chance_of_force


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
