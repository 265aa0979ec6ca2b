"""Block-arrow normal equations: elimination of the window states reduces them to a small dense system."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from identification.windows.layout import GAP_ERROR, GAP_PRIOR_STD, Active, Estimate


@dataclasses.dataclass(frozen=True, kw_only=True)
class Equations:
    """Cost, gradient and Gauss-Newton Hessian of every window, as NumPy arrays; see `residual.Normal`."""

    hessian: np.ndarray
    gradient: np.ndarray
    cost: np.ndarray
    record: np.ndarray

    def total(self, estimate: Estimate) -> float:
        """Cost of all windows and of the prior on the gap errors."""
        return float(self.cost.sum() + 0.5 * np.sum((estimate.nuisances[:, GAP_ERROR] / GAP_PRIOR_STD) ** 2))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reduced:
    """Normal equations with the window states eliminated; the unknowns are shared parameters, then nuisances record by record."""

    hessian: np.ndarray
    gradient: np.ndarray
    scores: np.ndarray
    """(windows, unknowns): contribution of each window to `gradient`."""
    active: np.ndarray
    """(unknowns,) bool"""
    eliminated: tuple[np.ndarray, np.ndarray]
    """(windows, states, states) inverse of the state blocks, (windows, states, size - states) coupling."""


def reduce(equations: Equations, estimate: Estimate, active: Active, damping: float) -> Reduced:
    """Eliminate the window states (Schur complement) and sum over the windows."""
    count = equations.hessian.shape[2] - estimate.states.shape[1]
    hessian = equations.hessian + damping * diagonal(equations.hessian)
    state = hessian[:, count:, count:]
    size = np.sqrt(np.einsum("lss->ls", state))
    scale = np.where(size > 0, size, 1.0)
    scale = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.pinv(state / scale, hermitian=True) / scale
    coupling = hessian[:, count:, :count]
    local_hessian = hessian[:, :count, :count] - np.einsum("lsi,lst,ltj->lij", coupling, inverse, coupling)
    local_gradient = equations.gradient[:, :count] - np.einsum("lsi,lst,lt->li", coupling, inverse, equations.gradient[:, count:])

    shared, records = len(estimate.shared), len(estimate.nuisances)
    width = estimate.nuisances.shape[1]
    size, where = shared + width * records, columns(estimate, equations.record)
    total, scores = np.zeros((size, size)), np.zeros((len(where), size))
    np.add.at(total, (where[:, :, None], where[:, None, :]), local_hessian)
    np.put_along_axis(scores, where, local_gradient, axis=1)
    gaps = shared + width * np.arange(records) + GAP_ERROR
    total[gaps, gaps] += (1.0 + damping) / GAP_PRIOR_STD**2
    gradient = scores.sum(axis=0)
    gradient[gaps] += estimate.nuisances[:, GAP_ERROR] / GAP_PRIOR_STD**2
    flags = np.concatenate([active.shared, active.nuisances.ravel()])
    return Reduced(hessian=total, gradient=gradient, scores=scores, active=flags, eliminated=(inverse, coupling))


def columns(estimate: Estimate, record: Int[np.ndarray, " windows"]) -> Int[np.ndarray, "windows unknowns"]:
    """Indices of each window's shared parameters and nuisances among all unknowns."""
    shared, width = len(estimate.shared), estimate.nuisances.shape[1]
    own = shared + width * record[:, None] + np.arange(width)
    return np.concatenate([np.broadcast_to(np.arange(shared), (len(own), shared)), own], axis=1)


def solve(
    reduced: Reduced, equations: Equations, estimate: Estimate, *, longest: float = np.inf
) -> tuple[Float[np.ndarray, " shared"], Float[np.ndarray, "records nuisances"], Float[np.ndarray, "windows states"]]:
    """Step of shared parameters, nuisances and window states; unknowns that are fixed or not identifiable do not move.

    A shared parameter that would move by more than `longest` is limited to that, and all others follow it.
    """
    shared = len(estimate.shared)
    step = _step_within(reduced, shared, longest)
    nuisances = step[shared:].reshape(estimate.nuisances.shape)
    local = np.concatenate([np.broadcast_to(step[:shared], (len(equations.record), shared)), nuisances[equations.record]], axis=1)
    inverse, coupling = reduced.eliminated
    right = equations.gradient[:, -inverse.shape[1] :] + np.einsum("lsi,li->ls", coupling, local)
    return step[:shared], nuisances, -np.einsum("lst,lt->ls", inverse, right)


def _step_within(reduced: Reduced, shared: int, longest: float) -> Float[np.ndarray, " unknowns"]:
    """Newton step; its shared components longer than `longest` are limited one by one and held."""
    step, free = np.zeros(len(reduced.gradient)), reduced.active.copy()
    while True:
        held = step != 0
        held[free] = False
        gradient = reduced.gradient[free] + reduced.hessian[np.ix_(free, held)] @ step[held]
        step[free] = -covariance(reduced.hessian[np.ix_(free, free)]) @ gradient
        lengths = np.where(free[:shared], np.abs(step[:shared]), 0.0)
        if not lengths.max(initial=0.0) > longest:  # NaN is passed on to the caller
            return step
        far = int(np.argmax(lengths))
        step[far], free[far] = np.copysign(longest, step[far]), False


def covariance(hessian: Float[np.ndarray, "unknowns unknowns"]) -> Float[np.ndarray, "unknowns unknowns"]:
    """Inverse of a positive semi-definite matrix after scaling its diagonal to one; directions below 1e-12 are left out."""
    scale = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    return np.linalg.pinv(hessian / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)


def newton_decrement(reduced: Reduced, equations: Equations) -> float:
    """g' H^-1 g of the active unknowns and all window states."""
    part = reduced.active
    inverse, _ = reduced.eliminated
    gradient, states = reduced.gradient[part], equations.gradient[:, -inverse.shape[1] :]
    from_states = np.einsum("ls,lst,lt->", states, inverse, states)
    return float(gradient @ covariance(reduced.hessian[np.ix_(part, part)]) @ gradient + from_states)


def diagonal(matrices: Float[np.ndarray, "... unknowns unknowns"]) -> Float[np.ndarray, "... unknowns unknowns"]:
    """The diagonal of each matrix of a stack, as a diagonal matrix."""
    return matrices * np.eye(matrices.shape[-1])
