"""Refits of the search: a failed one is None, and a fit that has not converged gets a second start."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from identification.diagnosis.refit import lengthened
from identification.least_squares.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt
from identification.likelihood.fitted import Fitted, fitted
from identification.likelihood.joint import point
from identification.likelihood.variances import Variances
from identification.windows.prepare import Prepared
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]


def attempt(prepared: Prepared, variances: Variances, *, rounds: int, **options: Any) -> Fitted | None:
    """A fit from the prepared start, with options of `fitted`; None where the integration fails or the likelihood is not finite."""
    try:
        found = fitted(point(prepared, prepared.start, variances), rounds=rounds, measure_noise=False, **options)
    except (NoConvergenceError, np.linalg.LinAlgError):
        return None
    return found if np.isfinite(found.log_likelihood) else None


def to_the_end(found: Fitted) -> Fitted | None:
    """The chosen fit on windows as long as they may be, converged; None where that fails."""
    try:
        return lengthened(found) or fitted(point(found.prepared, found.estimate, found.variances))
    except (NoConvergenceError, np.linalg.LinAlgError):
        return None


def by_least_squares(found: Fitted, progress: Progress) -> Fitted:
    """The better, by BIC, of a fit that has not converged and of one that starts from least squares.

    An estimated random force stands in for an effect that starts far from its place, and then holds it there.
    """
    progress(f"fitting {found.title} by least squares")
    prepared = found.prepared
    start = dataclasses.replace(found.estimate, force=np.zeros_like(found.estimate.force))
    try:
        outcome = LevenbergMarquardt()(evaluator(prepared, integrator_for(prepared)), start, free_unknowns(prepared), bounds(prepared))
    except (NoConvergenceError, np.linalg.LinAlgError):
        return found
    other = attempt(dataclasses.replace(prepared, start=outcome.estimate), found.variances, rounds=3)
    return other if other is not None and other.criterion < found.criterion else found
