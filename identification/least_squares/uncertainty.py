"""Standard errors and identifiability: covariance of the estimates and 95 % intervals."""

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from scipy.special import chdtri, ndtri

from identification.least_squares.block_arrow import Equations, Reduced, covariance, newton_decrement, reduce, solve
from identification.windows.layout import Active, Estimate

CHI2_95 = float(chdtri(1, 0.05))
_SIGMAS_95 = float(ndtri(0.975))
_NULL = 1e-11
"""Eigenvalue of the scaled Gauss-Newton matrix below which a direction is not identifiable."""
_WIDEST = 1.0
"""Standard error in internal coordinates (a factor of e) above which a parameter is not identifiable."""
_CURVED = 0.1
"""Relative departure of the log-likelihood from a parabola at 1.96 standard errors above which the interval is a profile."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Standard errors of the shared parameters (internal coordinates) and of the nuisances.

    Attributes:
        covariance: of all unknowns (shared, then nuisances record by record); zero rows where not estimated.
        identifiable: (parameters,) bool; False for free parameters that the records do not identify.
    """

    covariance: np.ndarray
    identifiable: np.ndarray

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors of all unknowns."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def correlation(self, chosen: np.ndarray) -> np.ndarray:
        """Correlation matrix of the chosen unknowns."""
        part = self.covariance[np.ix_(chosen, chosen)]
        scale = np.sqrt(np.diag(part))
        return part / np.outer(scale, scale)


def uncertainty(equations: Equations, estimate: Estimate, active: Active) -> Uncertainty:
    """Covariance at the optimum: inverse Gauss-Newton matrix of the normal equations of the likelihood."""
    identifiable = _identifiable(reduce(equations, estimate, active, 0.0), len(estimate.shared))
    kept = dataclasses.replace(active, shared=active.shared & identifiable)
    reduced = reduce(equations, estimate, kept, 0.0)
    full, part = np.zeros_like(reduced.hessian), reduced.active
    full[np.ix_(part, part)] = covariance(reduced.hessian[np.ix_(part, part)])
    identifiable &= np.sqrt(np.maximum(np.diag(full), 0.0))[: len(identifiable)] <= _WIDEST
    return Uncertainty(covariance=full, identifiable=identifiable)


def _identifiable(reduced: Reduced, shared: int) -> np.ndarray:
    """(parameters,) bool: identifiable, with a standard error below a factor of e; parameters that are not free count as identifiable."""
    part = np.flatnonzero(reduced.active)
    hessian = reduced.hessian[np.ix_(part, part)]
    scale = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    seen = scale > 0
    values, vectors = np.linalg.eigh(hessian / np.outer(np.where(seen, scale, 1.0), np.where(seen, scale, 1.0)))
    loose = np.any((np.abs(vectors) > 0.05) & (values < _NULL), axis=1) | ~seen
    wide = np.sqrt(np.maximum(np.diag(covariance(hessian)), 0.0)) > _WIDEST
    answer = np.ones(shared, bool)
    mine = part < shared
    answer[part[mine]] = ~(loose | wide)[mine]
    return answer


def interval(
    evaluate: Callable[[Estimate], Equations], equations: Equations, estimate: Estimate, active: Active, spread: Uncertainty, index: int
) -> tuple[float, float, str]:
    """95 % interval of one shared parameter in internal coordinates, and whether it is "normal" or a "profile".

    The profile likelihood is followed along its tangent; one Gauss-Newton step moves all other unknowns at every point.
    """
    best = equations.total(estimate)
    sigma = spread.stderr[index]
    bare = np.sqrt(covariance_of(equations, estimate, active)[index, index])
    widening = sigma / bare

    def rise(sigmas: float) -> float:
        return profile_cost(evaluate, equations, estimate, active, {index: sigmas * bare}) - best

    ends, kind = [], "normal"
    for side in (-1.0, 1.0):
        reach = _SIGMAS_95
        measured = 2.0 * rise(side * reach)
        for _ in range(6):
            if abs(measured / CHI2_95 - 1.0) < _CURVED or not np.isfinite(measured) or measured <= 0:
                break
            kind = "profile"
            reach *= float(np.clip(np.sqrt(CHI2_95 / measured), 0.3, 3.0))
            measured = 2.0 * rise(side * reach)
        ends.append(estimate.shared[index] + side * reach * bare * widening)
    return ends[0], ends[1], kind


def covariance_of(equations: Equations, estimate: Estimate, active: Active) -> np.ndarray:
    """Covariance (inverse Gauss-Newton matrix) of all unknowns, zero where not active."""
    reduced = reduce(equations, estimate, active, 0.0)
    full = np.zeros_like(reduced.hessian)
    full[np.ix_(reduced.active, reduced.active)] = covariance(reduced.hessian[np.ix_(reduced.active, reduced.active)])
    return full


def profile_cost(
    evaluate: Callable[[Estimate], Equations], equations: Equations, estimate: Estimate, active: Active, shifts: Mapping[int, float]
) -> float:
    """Cost of the profile likelihood with some shared parameters shifted from the optimum, by index, in internal coordinates.

    All other unknowns follow to first order from the optimum; one Gauss-Newton step from there gives the cost by its quadratic prediction.
    """
    index, shift = np.array(list(shifts)), np.array(list(shifts.values()))
    shared = estimate.shared.copy()
    shared[index] += shift
    others = dataclasses.replace(active, shared=active.shared & ~np.isin(np.arange(len(shared)), index))
    pushed = dataclasses.replace(equations, gradient=equations.gradient + equations.hessian[:, :, index] @ shift)
    trial = dataclasses.replace(estimate, shared=shared).moved(*solve(reduce(pushed, estimate, others, 0.0), pushed, estimate))
    found = evaluate(trial)
    return found.total(trial) - 0.5 * newton_decrement(reduce(found, trial, others, 0.0), found)
