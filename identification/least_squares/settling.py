"""Fit of the windows' initial states on growing parts of each window."""

import dataclasses

import numpy as np

from identification.least_squares.fit import CHUNK, evaluator, integrator_for
from identification.least_squares.levenberg_marquardt import settle
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows
from vibrojax.integrate import AbstractBatchIntegrator

_SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Parts of a window, from its start, on which the initial state is fitted in turn."""


def settled_gradually(prepared: Prepared, integrator: AbstractBatchIntegrator, *, side_by_side: int = CHUNK) -> tuple[Estimate, np.ndarray]:
    """Fit the initial states from `prepared.start` on a growing part of every window; returns the windows' costs as well.

    A slightly wrong state may miss an impact late in the window, and no derivative leads back from there.
    """
    estimate, cost = prepared.start, np.zeros(len(prepared.record))
    for share in _SHARES:
        part = dataclasses.replace(prepared, groups=tuple(_beginning(group, share) for group in prepared.groups))
        estimate, cost = settle(evaluator(part, integrator, side_by_side=side_by_side), estimate)
    return estimate, cost


def _beginning(group: Windows, share: float) -> Windows:
    """The windows cut off: later samples have no weight and are not integrated."""
    lengths = np.ceil(share * group.lengths).astype(group.lengths.dtype)
    counts = np.arange(group.weight.shape[1]) < lengths[:, None]
    return dataclasses.replace(group, lengths=lengths, weight=np.where(counts[..., None], group.weight, 0.0))


def settled_without_force(prepared: Prepared, estimate: Estimate) -> tuple[Estimate, np.ndarray]:
    """The same parameters with the window states that fit best without random force, and the windows' costs, (windows,).

    Its motion is the prediction of the model itself.
    """
    without = dataclasses.replace(estimate, force=np.zeros((0, 0)))
    return settle(evaluator(prepared, integrator_for(prepared)), without, iterations=4)
