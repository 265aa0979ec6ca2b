"""The iteration in a curved valley, and when it stops."""

import numpy as np
import pytest

from identification.least_squares.block_arrow import Equations
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt
from identification.windows.layout import NUISANCES, STATES, Active, Estimate

ANYWHERE = (np.full(2, -np.inf), np.full(2, np.inf))
"""Bounds."""
BOTH = Active(shared=np.ones(2, bool), nuisances=np.zeros((1, len(NUISANCES)), bool))


def at(x: float, y: float) -> Estimate:
    """A point with one window whose state is not informative."""
    return Estimate(shared=np.array([x, y]), nuisances=np.zeros((1, len(NUISANCES))), states=np.zeros((1, len(STATES))))


@pytest.fixture
def valley():
    """Rosenbrock's, 100 (y - x^2)^2 + (1 - x)^2, a thousand times as steep."""

    def evaluate(estimate: Estimate) -> Equations:
        x, y = estimate.shared
        residual = np.sqrt(2e3) * np.array([10.0 * (y - x**2), 1.0 - x])
        jacobian = np.zeros((2, 2 + len(NUISANCES) + len(STATES)))
        jacobian[:, :2] = np.sqrt(2e3) * np.array([[-20.0 * x, 10.0], [-1.0, 0.0]])
        return Equations(
            hessian=(jacobian.T @ jacobian)[None],
            gradient=(jacobian.T @ residual)[None],
            cost=0.5 * np.array([residual @ residual]),
            record=np.zeros(1, int),
        )

    return evaluate


@pytest.mark.parametrize(("crawl", "floor", "stops"), [(0.0, 0.0, False), (0.5, 0.0, False), (0.5, -1e6, True)])
def test_it_stops_at_slow_convergence(valley, crawl, floor, stops):
    """No share of the cost is asked for; half of it, which eight iterations do remove; and much more than there is."""
    outcome = LevenbergMarquardt(crawl=crawl, floor=floor)(valley, at(0.5, 0.25), BOTH, ANYWHERE)
    assert outcome.converged is not stops
    assert (outcome.iterations == 9) is stops


def test_a_fit_that_arrives_with_its_last_iteration_has_converged(valley):
    """The length of the next step is that from where it ended."""
    free = LevenbergMarquardt()(valley, at(0.5, 0.25), BOTH, ANYWHERE)
    just = LevenbergMarquardt(most_iterations=free.iterations - 1)(valley, at(0.5, 0.25), BOTH, ANYWHERE)
    assert just.converged
    assert just.decrement == pytest.approx(free.decrement)
