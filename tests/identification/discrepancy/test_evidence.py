"""Chances of noise, and the tolerant cost."""

import numpy as np
import pytest

from identification.discrepancy.evidence import FALSE_ALARM, best_of_each, chance, significant
from identification.discrepancy.look import blank
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate
from vibrojax.effects import EFFECTS


def candidate(name: str, gain: float) -> Candidate:
    return Candidate(members=(blank(EFFECTS[name]),), factors=np.ones(1), gain=gain, degrees=1)


def test_more_trials_make_a_gain_less_telling():
    assert chance(20.0, 1, 100) == pytest.approx(100 * chance(20.0, 1, 1))
    assert chance(20.0, 1, 10**9) == 1.0


def test_only_gains_that_noise_would_hardly_give_are_significant():
    found = [candidate("coulomb_friction", 40.0), candidate("coulomb_friction", 90.0), candidate("gap_drift", 8.0)]
    assert best_of_each(found)["coulomb_friction"].gain == 90.0
    assert list(significant(found)) == ["coulomb_friction"]
    assert chance(8.0, 1, 1) > FALSE_ALARM


def test_the_tolerant_cost_is_the_plain_one_below_the_cut_and_its_slope_is_the_weight():
    allowed = Tolerance(samples=np.array([100, 100, 100]), cut=4.0)
    cost = np.array([50.0, 150.0, 5000.0])
    assert allowed.cost(cost)[:2] == pytest.approx(cost[:2])
    step = 1e-3
    slope = (allowed.cost(cost + step) - allowed.cost(cost - step)) / (2 * step)
    assert slope == pytest.approx(allowed.weights(cost), rel=1e-6)


def test_a_window_that_cannot_be_integrated_has_no_weight():
    allowed = Tolerance(samples=np.array([100]), cut=4.0)
    assert allowed.weights(np.array([np.inf]))[0] == 0.0
    assert allowed.cost(np.array([1e12]))[0] < allowed.total(np.array([np.inf])) < np.inf
