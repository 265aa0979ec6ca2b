"""Initial states of windows, found from their beginnings on."""

import dataclasses

import numpy as np

from identification.least_squares.fit import CHUNK, evaluator, integrator_for
from identification.least_squares.levenberg_marquardt import settle
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows
from vibrojax.integrate import Landing

_SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Of a window: so much of it tells its initial state, one after the other."""


def settled_gradually(prepared: Prepared, integrator: Landing, *, side_by_side: int = CHUNK) -> tuple[Estimate, np.ndarray]:
    """Initial states from `prepared.start` on, found on the beginning of every window and then on ever more of it; with the windows' costs.

    A state that is a little wrong misses an impact far along the window, from where no derivative leads back.
    """
    estimate, cost = prepared.start, np.zeros(len(prepared.record))
    for share in _SHARES:
        part = dataclasses.replace(prepared, groups=tuple(_beginning(group, share) for group in prepared.groups))
        estimate, cost = settle(evaluator(part, integrator, side_by_side=side_by_side), estimate)
    return estimate, cost


def _beginning(group: Windows, share: float) -> Windows:
    """The windows cut off: what comes later has no weight, and no step is taken for it."""
    lengths = np.ceil(share * group.lengths).astype(group.lengths.dtype)
    counts = np.arange(group.weight.shape[1]) < lengths[:, None]
    return dataclasses.replace(group, lengths=lengths, weight=np.where(counts[..., None], group.weight, 0.0))


def settled_without_force(prepared: Prepared, estimate: Estimate) -> Estimate:
    """The same parameters, with the windows' states that fit best where no random force acts: what the model itself predicts."""
    without = dataclasses.replace(estimate, force=np.zeros((0, 0)))
    return settle(evaluator(prepared, integrator_for(prepared)), without, iterations=4)[0]
