"""Check of a fit on windows of its records that it did not take."""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.least_squares.fit import integrator_for
from identification.least_squares.settling import settled_gradually
from identification.likelihood.fitted import Fitted
from identification.result.result import Unfitted
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, left_out


def unfitted(prepared: Prepared, of: Fitted, cost: Float[np.ndarray, " windows"]) -> Unfitted | None:
    """How well a fit predicts windows that it did not take: their initial states are estimated, and nothing else.

    Args:
        prepared: the experiment as prepared for the fit, which says what was left out.
        of: the fit.
        cost: of its own windows without random force, half chi-square.

    Returns:
        None where all windows are fitted, where the fit is one of shorter windows, or where none of the others can be integrated.
    """
    rest = left_out(prepared) if len(of.prepared.record) == len(prepared.record) else None
    if rest is None:
        return None
    estimate, layout = of.estimate, of.prepared.layout
    own = np.zeros((len(rest.record), len(layout.free_own)))
    start = Estimate(shared=estimate.shared, nuisances=estimate.nuisances, states=np.concatenate([rest.start.states, own], axis=1))
    rest = dataclasses.replace(rest, model=of.prepared.model, layout=layout, start=start)
    _, others = settled_gradually(rest, integrator_for(rest))
    if not np.isfinite(others).any():
        return None
    return Unfitted(
        windows=len(others),
        failed=int(np.sum(~np.isfinite(others))),
        samples=int(sum(group.lengths.sum() for group in rest.groups)),
        chi2_reduced=_median_chi2(rest, others),
        of_fitted=_median_chi2(of.prepared, cost),
    )


def _median_chi2(prepared: Prepared, cost: Float[np.ndarray, " windows"]) -> float:
    """Median, over the windows that were integrated, of chi-square over the degrees of freedom that a window's states leave."""
    counts = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in prepared.groups])
    return float(np.nanmedian(np.where(np.isfinite(cost), 2.0 * cost / np.maximum(counts - prepared.layout.states, 1), np.nan)))
