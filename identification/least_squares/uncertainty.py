"""Standard errors and identifiability: covariance of the estimates."""

import dataclasses

import numpy as np

from identification.least_squares.block_arrow import Equations, Reduced, covariance, reduce
from identification.windows.layout import Active, Estimate

_NULL = 1e-11
"""Eigenvalue of the scaled Gauss-Newton matrix below which a direction is not identifiable."""
_WIDEST = 1.0
"""Standard error in internal coordinates (a factor of e) above which a parameter is not identifiable."""


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
