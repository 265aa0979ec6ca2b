"""Practical relevance: the share of the misfit that a further effect or term explains, or predicts on windows left out of the fit."""

import numpy as np
from jaxtyping import Float

from identification.likelihood.fitted import Fitted


def share_added(nominal: Fitted, model: Fitted, more: Fitted) -> float:
    """Share of the misfit, in reduced chi-square without random force, that only the larger of two models explains; 1 for a first effect.

    Windows count as in the fit of `more`: those that it gives little weight, since nothing explains them, hide no effect in the others.
    """
    return share(*(misfit(one, more) for one in (nominal, model, more))) if model.names else 1.0


def share(nominal: float, model: float, more: float) -> float:
    """Share of the misfit that only the larger model explains, from three reduced chi-squares.

    It is 0 where the larger model explains no more than the smaller one, or where a chi-square is not finite; 1 where the larger one is
    better than the smaller, and both are worse than the nominal model.

    Example:
        >>> share(11.0, 2.0, 1.0), share(11.0, 10.0, 11.1), share(2.0, 12.0, 3.0), share(11.0, float("nan"), 1.0)
        (0.1, 0.0, 1.0, 0.0)
    """
    if not np.isfinite([nominal, model, more]).all() or more >= model:
        return 0.0
    return (model - more) / (nominal - more) if nominal > more else 1.0


def share_predicted(model: float, more: float) -> float:
    """Share of the mean squared error on windows left out that only the larger model predicts, from two normalised errors; NaN if unknown.

    Example:
        >>> share_predicted(0.10, 0.05), share_predicted(0.10, 0.20), share_predicted(float("nan"), 0.2)
        (0.75, -3.0, nan)
    """
    return 1.0 - (more / model) ** 2


def residual_share(found: Fitted, beside: Fitted) -> float:
    """Residual share of the misfit of a model that remains with a further effect."""
    return (misfit(found, found) - 1.0) / max(misfit(beside, found) - 1.0, 1e-300)


def misfit(of: Fitted, like: Fitted) -> float:
    """Reduced chi-square of a fit, with the windows weighted as in another fit of the same records, which may have other windows."""
    return of.weighted_chi2(weights(of, like))


def weights(of: Fitted, like: Fitted) -> Float[np.ndarray, " windows"]:
    """Weight of each window in another fit of the same records: the mean over its samples, at most 1."""
    known = [np.full(len(record.time), np.nan) for record in of.prepared.experiment.records]
    for record, place, weight in zip(like.prepared.record, _places(like), like.variances.weight, strict=True):
        known[record][place] = min(weight, 1.0)
    found = [known[record][place] for record, place in zip(of.prepared.record, _places(of), strict=True)]
    return np.array([1.0 if np.isnan(each).all() else float(np.nanmean(each)) for each in found])


def _places(fitted: Fitted) -> list[slice]:
    """Samples of every window in its record."""
    groups = fitted.prepared.groups
    ends = ((first, first + length) for group in groups for first, length in zip(group.first, group.lengths, strict=True))
    return [slice(int(first), int(end)) for first, end in ends]
