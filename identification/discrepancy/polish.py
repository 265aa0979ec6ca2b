"""The last fit: the chosen model on the long windows of an ordinary fit, which see more."""

import dataclasses

import numpy as np

from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import fit_tolerantly
from identification.prepare import Prepared


def polished(found: Fitted, long: Prepared) -> Fitted | None:
    """The model of `found`, fitted to the windows of `long`; None where that does not settle.

    Arguments:
        found: on short windows.
        long: the nominal model on the windows of an ordinary fit, with its start.
    """
    estimate = found.outcome.estimate
    own = _own_states(found, long)
    start = with_model(long, found.model, estimate.nuisances, np.concatenate([long.start.states, own], axis=1))
    start = dataclasses.replace(start, fixed=found.prepared.fixed)
    whole = Fitted(prepared=start, outcome=found.outcome)
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in long.groups])
    allowed = Tolerance(samples=samples, cut=25.0)
    fitted = fit_tolerantly(whole.prepared, allowed)
    return None if fitted is None or not np.isfinite(fitted.chi2) else fitted


def _own_states(found: Fitted, long: Prepared) -> np.ndarray:
    """Own states of effects at the start of every long window: those of the short window nearest to it."""
    count = found.outcome.estimate.states.shape[1] - 2
    first = np.concatenate([group.first for group in found.prepared.groups])
    begins = np.concatenate([group.first for group in long.groups])
    states = np.zeros((len(begins), count))
    for window, (record, begin) in enumerate(zip(long.record, begins, strict=True)):
        mine = np.flatnonzero(found.prepared.record == record)
        states[window] = found.outcome.estimate.states[mine[np.argmin(np.abs(first[mine] - begin))], 2:]
    return states
