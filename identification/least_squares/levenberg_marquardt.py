"""Levenberg-Marquardt with a trust region, and the fit of the windows' initial states alone."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.least_squares.block_arrow import Equations, diagonal, newton_decrement, reduce, solve
from identification.windows.layout import Active, Estimate
from vibrojax.errors import NoConvergenceError

_PATIENCE = 8
"""Iterations over which slow convergence is judged; that many may fail in a row before the damping has grown enough."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of a Levenberg-Marquardt iteration."""

    estimate: Estimate
    equations: Equations
    cost: float
    converged: bool
    iterations: int
    decrement: float
    """Squared length of the next Gauss-Newton step in standard errors."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LevenbergMarquardt:
    """Levenberg-Marquardt iteration with a trust region.

    Converged when the full remaining Gauss-Newton step is shorter than `tolerance` standard errors, or when the expected decrease of the
    cost is within the rounding of the integration. No shared parameter moves by more than `longest_step` at once (a factor of e^0.7 for
    those estimated by their logarithm); where one would, the others follow it.
    """

    tolerance: float = 0.03
    flat: float = 1e-8
    """Relative change of the cost that counts as zero."""
    longest_step: float = 0.7
    most_iterations: int = 40
    crawl: float = 0.0
    floor: float = 0.0
    """Slow convergence ends the iteration: `_PATIENCE` iterations lower the cost above `floor` by less than the share `crawl`."""

    def __call__(
        self,
        evaluate: Callable[[Estimate], Equations],
        start: Estimate,
        active: Active,
        bounds: tuple[np.ndarray, np.ndarray],
        progress: Callable[[int, float], None] = lambda iteration, cost: None,
    ) -> Outcome:
        """Minimise from `start`; a start that cannot be integrated raises `NoConvergenceError`."""
        estimate, equations = start, evaluate(start)
        cost, damping, growth = equations.total(estimate), 1e-4, 2.0
        if not np.isfinite(cost):
            raise NoConvergenceError("the model cannot be integrated from the first guess: give better starts in [parameters]")
        costs = [np.inf] * _PATIENCE
        for iteration in range(1, self.most_iterations + 1):
            free, decrement = _to_go(equations, estimate, active, bounds)
            progress(iteration, cost)
            costs.append(cost)
            if decrement < self.tolerance**2 or costs[-1 - _PATIENCE] - cost < self.crawl * (cost - self.floor):
                break
            trial = self._trial(estimate, equations, free, bounds, damping)
            after = evaluate(trial)
            new_cost = after.total(trial)
            flat = abs(new_cost - cost) <= self.flat * cost and decrement <= 2.0 * self.flat * cost
            if new_cost < cost:
                estimate, equations, cost = trial, after, new_cost
                damping, growth = max(damping / 10.0, 1e-9), 2.0
            else:
                damping, growth = damping * growth, growth * 2.0
            if flat or damping > 1e12:
                break
        _, decrement = _to_go(equations, estimate, active, bounds)
        converged = decrement <= max(self.tolerance**2, 2.0 * self.flat * cost)
        return Outcome(estimate=estimate, equations=equations, cost=cost, converged=converged, iterations=iteration, decrement=decrement)

    def _trial(self, estimate: Estimate, equations: Equations, active: Active, bounds, damping: float) -> Estimate:
        """Damped step within the trust region, clipped to the bounds."""
        shared, nuisances, states = solve(reduce(equations, estimate, active, damping), equations, estimate, longest=self.longest_step)
        moved = estimate.moved(shared, nuisances, states)
        return dataclasses.replace(moved, shared=np.clip(moved.shared, *bounds))


def _to_go(equations: Equations, estimate: Estimate, active: Active, bounds: tuple[np.ndarray, np.ndarray]) -> tuple[Active, float]:
    """The unknowns that may move, and the squared length of their Gauss-Newton step in standard errors."""
    free = off_the_bounds(equations, estimate, active, bounds)
    return free, float(newton_decrement(reduce(equations, estimate, free, 0.0), equations))


def off_the_bounds(equations: Equations, estimate: Estimate, active: Active, bounds: tuple[np.ndarray, np.ndarray]) -> Active:
    """The active unknowns without the shared parameters at a bound whose step points out of their range."""
    slope = reduce(equations, estimate, active, 0.0).gradient[: len(estimate.shared)]
    low, high = bounds
    leaving = ((estimate.shared <= low) & (slope > 0)) | ((estimate.shared >= high) & (slope < 0))
    return dataclasses.replace(active, shared=active.shared & ~leaving)


def settle(evaluate: Callable[[Estimate], Equations], estimate: Estimate, *, iterations: int = 6) -> tuple[Estimate, np.ndarray]:
    """Fit the initial state of every window by itself, each with its own damping, all else fixed.

    A window with a bad start then does not delay the others, as it would in a common trust region. Returns the windows' costs as well.
    """
    equations, count = evaluate(estimate), estimate.states.shape[1]
    damping = np.full(len(equations.cost), 1e-3)
    for _ in range(iterations):
        block = equations.hessian[:, -count:, -count:]
        damped = block + damping[:, None, None] * diagonal(block) + 1e-300 * np.eye(count)
        step = -np.linalg.solve(damped, equations.gradient[:, -count:, None])[..., 0]
        trial = dataclasses.replace(estimate, states=estimate.states + np.where(np.isfinite(step), step, 0.0))
        after = evaluate(trial)
        better = after.cost < equations.cost
        changed = np.where(np.isfinite(after.cost), np.abs(after.cost - np.nan_to_num(equations.cost)), 0.0)
        if np.all(changed < 0.5):
            break
        estimate = dataclasses.replace(estimate, states=np.where(better[:, None], trial.states, estimate.states))
        equations = Equations(
            hessian=np.where(better[:, None, None], after.hessian, equations.hessian),
            gradient=np.where(better[:, None], after.gradient, equations.gradient),
            cost=np.where(better, after.cost, equations.cost),
            record=equations.record,
        )
        damping = np.where(better, damping / 10.0, damping * 10.0)
    return estimate, equations.cost
