"""Levenberg-Marquardt on block-arrow normal equations: window states are eliminated, the rest is a small dense system."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.layout import NUISANCES, Active, Estimate

GAP_PRIOR_STD = 1e-3
"""m; wide enough not to be felt where impacts show the gap, narrow enough to hold it where they do not."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Equations:
    """Gauss-Newton quantities of every window as host arrays; see `residual.Normal`."""

    hessian: np.ndarray
    gradient: np.ndarray
    cost: np.ndarray
    record: np.ndarray

    def total(self, estimate: Estimate) -> float:
        """Cost of all windows and of the prior on the gap errors."""
        return float(self.cost.sum() + 0.5 * np.sum((estimate.nuisances[:, 2] / GAP_PRIOR_STD) ** 2))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reduced:
    """Normal equations after the window states are eliminated: unknowns are shared parameters, then the nuisances record by record."""

    hessian: np.ndarray
    gradient: np.ndarray
    scores: np.ndarray
    """(windows, unknowns): what each window adds to `gradient`."""
    active: np.ndarray
    """(unknowns,) bool"""
    eliminated: tuple[np.ndarray, np.ndarray]
    """(windows, 2, 2) inverse of the state blocks, (windows, 2, size - 2) coupling."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """Where the iteration ended."""

    estimate: Estimate
    equations: Equations
    cost: float
    converged: bool
    iterations: int
    decrement: float
    """Squared length of the next Gauss-Newton step in standard errors."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LevenbergMarquardt:
    """Trust-region control of the iteration.

    Converged when the whole remaining Gauss-Newton step is shorter than `tolerance` standard errors, or when steps no longer lower
    the cost by as much as they promise because it is flat to within the rounding of the integration. A step is cut so that no
    shared parameter moves by more than `longest_step` (a factor of e^0.7 for those estimated by their logarithm).
    """

    tolerance: float = 0.03
    flat: float = 1e-6
    """Relative change of the cost that counts as none."""
    longest_step: float = 0.7
    most_iterations: int = 40

    def __call__(
        self,
        evaluate: Callable[[Estimate], Equations],
        start: Estimate,
        active: Active,
        bounds: tuple[np.ndarray, np.ndarray],
        progress: Callable[[int, float], None] = lambda iteration, cost: None,
    ) -> Outcome:
        """Minimise from `start`; a start that cannot be integrated raises `ArithmeticError`."""
        estimate, equations = start, evaluate(start)
        cost, damping, growth = equations.total(estimate), 1e-4, 2.0
        if not np.isfinite(cost):
            raise ArithmeticError("the first guess cannot be integrated")
        decrement = np.inf
        for iteration in range(1, self.most_iterations + 1):
            decrement = newton_decrement(reduce(equations, estimate, active, 0.0))
            progress(iteration, cost)
            if decrement < self.tolerance**2:
                break
            trial = self._trial(estimate, equations, active, bounds, damping)
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
        converged = decrement <= max(self.tolerance**2, 2.0 * self.flat * cost)
        return Outcome(
            estimate=estimate, equations=equations, cost=cost, converged=converged, iterations=iteration, decrement=float(decrement)
        )

    def _trial(self, estimate: Estimate, equations: Equations, active: Active, bounds, damping: float) -> Estimate:
        """Damped step, cut to the trust region and to the bounds."""
        shared, nuisances, states = solve(reduce(equations, estimate, active, damping), equations, estimate)
        cut = min(1.0, self.longest_step / max(np.abs(shared).max(initial=0.0), 1e-300))
        moved = estimate.moved(cut * shared, cut * nuisances, cut * states)
        return dataclasses.replace(moved, shared=np.clip(moved.shared, *bounds))


def settle(evaluate: Callable[[Estimate], Equations], estimate: Estimate, *, iterations: int = 6) -> Estimate:
    """Fit the initial state of every window on its own, each with its own damping, all else held.

    One window that starts badly then cannot hold up the others, as it would in a common trust region.
    """
    equations = evaluate(estimate)
    damping = np.full(len(equations.cost), 1e-3)
    for _ in range(iterations):
        block = equations.hessian[:, -2:, -2:]
        damped = block + damping[:, None, None] * _diagonal(block) + 1e-300 * np.eye(2)
        step = -np.linalg.solve(damped, equations.gradient[:, -2:, None])[..., 0]
        trial = dataclasses.replace(estimate, states=estimate.states + np.where(np.isfinite(step), step, 0.0))
        after = evaluate(trial)
        better = after.cost < equations.cost
        if np.all(np.abs(after.cost - equations.cost) < 0.5):
            break
        pick = lambda new, old: np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)
        estimate = dataclasses.replace(estimate, states=pick(trial.states, estimate.states))
        equations = dataclasses.replace(
            equations,
            hessian=pick(after.hessian, equations.hessian),
            gradient=pick(after.gradient, equations.gradient),
            cost=pick(after.cost, equations.cost),
        )
        damping = np.where(better, damping / 10.0, damping * 10.0)
    return estimate


def reduce(equations: Equations, estimate: Estimate, active: Active, damping: float) -> Reduced:
    """Eliminate the window states and sum the windows."""
    count = equations.hessian.shape[2] - 2
    hessian = equations.hessian + damping * _diagonal(equations.hessian)
    state = hessian[:, count:, count:]
    scale = np.trace(state, axis1=1, axis2=2)[:, None, None]
    inverse = np.linalg.pinv(state / np.where(scale > 0, scale, 1.0), hermitian=True) / np.where(scale > 0, scale, 1.0)
    coupling = hessian[:, count:, :count]
    local_hessian = hessian[:, :count, :count] - np.einsum("lsi,lst,ltj->lij", coupling, inverse, coupling)
    local_gradient = equations.gradient[:, :count] - np.einsum("lsi,lst,lt->li", coupling, inverse, equations.gradient[:, count:])

    shared, records = len(estimate.shared), len(estimate.nuisances)
    width = len(NUISANCES)
    size = shared + width * records
    columns = np.concatenate(
        [np.broadcast_to(np.arange(shared), (len(count_of := equations.record), shared)), shared + width * count_of[:, None] + np.arange(width)],
        axis=1,
    )
    total, scores = np.zeros((size, size)), np.zeros((len(columns), size))
    np.add.at(total, (columns[:, :, None], columns[:, None, :]), local_hessian)
    np.put_along_axis(scores, columns, local_gradient, axis=1)
    gaps = shared + width * np.arange(records) + 2
    total[gaps, gaps] += (1.0 + damping) / GAP_PRIOR_STD**2
    gradient = scores.sum(axis=0)
    gradient[gaps] += estimate.nuisances[:, 2] / GAP_PRIOR_STD**2
    flags = np.concatenate([active.shared, active.nuisances.ravel()])
    return Reduced(hessian=total, gradient=gradient, scores=scores, active=flags, eliminated=(inverse, coupling))


def solve(reduced: Reduced, equations: Equations, estimate: Estimate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Step of shared parameters, nuisances and window states; unknowns that are not active or not determined stay."""
    step = np.zeros(len(reduced.gradient))
    part = reduced.active
    step[part] = -covariance(reduced.hessian[np.ix_(part, part)]) @ reduced.gradient[part]
    shared = len(estimate.shared)
    nuisances = step[shared:].reshape(estimate.nuisances.shape)
    local = np.concatenate([np.broadcast_to(step[:shared], (len(equations.record), shared)), nuisances[equations.record]], axis=1)
    inverse, coupling = reduced.eliminated
    right = equations.gradient[:, -2:] + np.einsum("lsi,li->ls", coupling, local)
    return step[:shared], nuisances, -np.einsum("lst,lt->ls", inverse, right)


def covariance(hessian: np.ndarray) -> np.ndarray:
    """Inverse of a positive semi-definite matrix after scaling its diagonal to one; directions below 1e-12 are left out."""
    scale = np.sqrt(np.diag(hessian))
    scale = np.where(scale > 0, scale, 1.0)
    return np.linalg.pinv(hessian / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)


def newton_decrement(reduced: Reduced) -> float:
    """g' H^-1 g of the active unknowns."""
    part = reduced.active
    gradient = reduced.gradient[part]
    return float(gradient @ covariance(reduced.hessian[np.ix_(part, part)]) @ gradient)


def _diagonal(matrices: np.ndarray) -> np.ndarray:
    """The diagonals of a stack of matrices, as matrices."""
    return matrices * np.eye(matrices.shape[-1])
