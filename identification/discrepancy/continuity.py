"""Whether the states that an effect has of its own carry on from window to window, as those of a real one do."""

import dataclasses

import numpy as np

from identification.block_arrow import covariance
from identification.discrepancy.refit import Fitted
from identification.fit import evaluator, integrator_for
from identification.layout import STATES

_ASTRAY = 9.0
"""Cost over the median of the windows from which one has settled wrongly, and says nothing of its neighbours."""
_STEP = 0.1
"""Standard deviations, for the derivative of a window's end in its beginning."""


def continuity_cost(fitted: Fitted) -> float:
    """What it would cost, in half chi-square, if each window had to begin where the one before it ended.

    Windows are fitted with initial states of their own, which frees an effect with memory from its past: a Bouc-Wen element that hardly
    yields, say, becomes a constant force that each window chooses anew. To second order the price of continuity is half of j' S^-1 j
    (Wald), with the jumps j = z_(w+1) - end of z_w and their covariance S, in which neighbours share a window; about half a unit each
    for a real effect. Where only some windows have their neighbour beside them, it is scaled up to all.
    """
    columns = _carried(fitted)
    before, after = _neighbours(fitted)
    if not len(columns) or not len(before):
        return 0.0
    states, own = fitted.prepared.layout.states, len(columns)
    blocks = fitted.outcome.equations.hessian[:, -states:, -states:]
    variance = np.stack([covariance(block) for block in blocks])[:, columns[:, None], columns]
    slope = _slope(fitted, columns, np.sqrt(np.maximum(np.einsum("lss->ls", variance), 0.0)))
    jump = fitted.outcome.estimate.states[after][:, columns] - fitted.outcome.equations.onward[before][:, columns]
    place = {window: index for index, window in enumerate(before)}
    joint = np.zeros((len(before), own, len(before), own))
    for index, (left, right) in enumerate(zip(before, after, strict=True)):
        joint[index, :, index] = variance[right] + slope[left] @ variance[left] @ slope[left].T
        following = place.get(right)
        if following is not None:
            shared = -variance[right] @ slope[right].T
            joint[index, :, following], joint[following, :, index] = shared, shared.T
    flat = jump.ravel()
    squared = float(flat @ covariance(joint.reshape(flat.size, flat.size)) @ flat)
    return 0.5 * squared * len(blocks) / len(before)


def jump_variance(fitted: Fitted) -> float:
    """Mean squared jump from window to window in its standard errors: about 1 for a real effect; 0 where nothing carries on."""
    numbers = len(_carried(fitted)) * len(fitted.prepared.record)
    return 2.0 * continuity_cost(fitted) / numbers if numbers else 0.0


def _carried(fitted: Fitted) -> np.ndarray:
    """Columns, among a window's states, of the effects' own that carry on."""
    layout = fitted.prepared.layout
    return len(STATES) + np.array([k for k, index in enumerate(layout.free_own) if layout.own_states[index].carried], int)


def _slope(fitted: Fitted, columns: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """(windows, own, own): derivative of the states at a window's end in those at its beginning."""
    prepared, outcome = fitted.prepared, fitted.outcome
    evaluate, found = evaluator(prepared, integrator_for(prepared)), np.zeros((len(sigma), len(columns), len(columns)))
    for k, column in enumerate(columns):
        step = _STEP * np.maximum(sigma[:, k], 1e-300)
        states = outcome.estimate.states.copy()
        states[:, column] += step
        moved = evaluate(dataclasses.replace(outcome.estimate, states=states)).onward - outcome.equations.onward
        found[:, :, k] = np.nan_to_num(moved[:, columns] / step[:, None])
    return found


def _neighbours(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Windows that end where another one begins, and these; both fitted as most are."""
    prepared, cost = fitted.prepared, fitted.outcome.equations.cost
    sound = np.isfinite(cost) & (cost <= _ASTRAY * np.median(cost))
    first = np.concatenate([group.first for group in prepared.groups])
    end = first + np.concatenate([group.lengths for group in prepared.groups])
    begins = {(record, start): window for window, (record, start) in enumerate(zip(prepared.record, first, strict=True))}
    pairs = [(window, begins[key]) for window, key in enumerate(zip(prepared.record, end, strict=True)) if key in begins]
    found = np.array([(left, right) for left, right in pairs if sound[left] and sound[right]], int).reshape(-1, 2)
    return found[:, 0], found[:, 1]
