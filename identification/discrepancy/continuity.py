"""Whether windows meet: the states that an effect has of its own, as those of a real one do, and the motion itself."""

import numpy as np

from identification.block_arrow import columns, covariance, reduce
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import free_unknowns
from identification.layout import STATES

_ASTRAY = 9.0
"""Cost over the median of the windows from which one has settled wrongly, and says nothing of its neighbours."""
_DEVIATIONS = 3.0
"""Standard deviations up to which a gain is put down to noise."""


def whole_cost(fitted: Fitted, allowed: Tolerance) -> float:
    """Tolerant cost of all windows, and the price of the effects' own states."""
    return allowed.total(fitted.outcome.equations.cost) + states_cost(fitted)


def states_cost(fitted: Fitted) -> float:
    """What states that each window may choose cost, in half chi-square: their continuity, and no less than noise gains by them.

    Jumps that a prior holds show no freedom: a hysteresis that hardly yields then looks better than the constant force that it is.
    """
    return max(continuity_cost(fitted), 0.5 * float(np.trace(_determined(fitted), axis1=1, axis2=2).sum()))


def states_margin(fitted: Fitted) -> float:
    """Three standard deviations of what noise gains by the windows' own states, in half chi-square."""
    return _DEVIATIONS * float(np.sqrt(0.5 * np.sum(_determined(fitted) ** 2)))


def _determined(fitted: Fitted) -> np.ndarray:
    """(windows, own, own): I - V / (s s'), V the variance of a window's own states beside its others and s the scale of their prior.

    An eigenvalue is 1 for what the window determines, where noise gains half a chi-square of one degree, and 0 for what the prior does.
    """
    own, layout = _carried(fitted), fitted.prepared.layout
    scale = np.array([layout.own_states[layout.free_own[column - len(STATES)]].scale for column in own])
    return np.eye(len(own)) - _variance(fitted)[:, own[:, None], own] / np.outer(scale, scale)


def states_variance(fitted: Fitted) -> np.ndarray:
    """(windows, states): of the states that each window begins with, at fixed parameters."""
    return np.diagonal(_variance(fitted), axis1=1, axis2=2)


def _variance(fitted: Fitted) -> np.ndarray:
    """(windows, states, states): of a window's states beside its others, at fixed parameters."""
    return reduce(fitted.outcome.equations, fitted.outcome.estimate, free_unknowns(fitted.prepared), 0.0).eliminated[0]


def continuity_cost(fitted: Fitted) -> float:
    """What it would cost, in half chi-square, if each window had to begin where the one before it ended.

    Windows are fitted with initial states of their own, which frees an effect with memory from its past: a Bouc-Wen element that hardly
    yields, say, becomes a constant force that each window chooses anew. To second order the price of continuity is half of j' S^-1 j
    (Wald), with the jumps j = z_(w+1) - end of z_w and their covariance S: neighbours share a window, and all of them the parameters,
    which may be off by their errors and move every jump together. About half a unit each for a real effect. Where only some windows have
    their neighbour beside them, it is scaled up to all.
    """
    own = _carried(fitted)
    return 0.5 * _mean_square(fitted, own) * len(own) * len(fitted.prepared.record)


def jump_variance(fitted: Fitted) -> float:
    """Mean squared jump from window to window in its standard errors: about 1 for a real effect; 0 where nothing carries on."""
    return _mean_square(fitted, _carried(fitted))


def apart(fitted: Fitted) -> float:
    """The same of all states, u and u' too: about 1 where the model is complete, hundreds where short windows forgive what it lacks."""
    return _mean_square(fitted, np.arange(fitted.prepared.layout.states))


def _mean_square(fitted: Fitted, chosen: np.ndarray) -> float:
    """j' S^-1 j of the jumps of some states over their count; 0 where there is none."""
    before, after = _neighbours(fitted)
    if not len(chosen) or not len(before):
        return 0.0
    jump = (fitted.outcome.estimate.states[after] - fitted.outcome.equations.onward[before])[:, chosen].ravel()
    return float(jump @ covariance(_covariance_of_jumps(fitted, chosen, before, after)) @ jump) / jump.size


def _carried(fitted: Fitted) -> np.ndarray:
    """Columns, among a window's states, of the effects' own that carry on."""
    layout = fitted.prepared.layout
    return len(STATES) + np.array([k for k, index in enumerate(layout.free_own) if layout.own_states[index].carried], int)


def _covariance_of_jumps(fitted: Fitted, own: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(jumps, jumps): of the windows' own states at fixed parameters, and of these."""
    estimate, equations = fitted.outcome.estimate, fitted.outcome.equations
    reduced = reduce(equations, estimate, free_unknowns(fitted.prepared), 0.0)
    variance, coupling = reduced.eliminated
    others = coupling.shape[2]
    ends = np.nan_to_num(equations.onward_jacobian[:, own])
    ahead = ends[:, :, others:] @ variance
    place, size = {window: index for index, window in enumerate(before)}, len(own)
    joint = np.zeros((len(before), size, len(before), size))
    for index, (left, right) in enumerate(zip(before, after, strict=True)):
        joint[index, :, index] = variance[right][np.ix_(own, own)] + ahead[left] @ ends[left, :, others:].T
        following = place.get(right)
        if following is not None:
            shared = -ahead[right][:, own].T
            joint[index, :, following], joint[following, :, index] = shared, shared.T
    along = ahead @ coupling - ends[:, :, :others]  # of an end, less that at its beginning, in the other unknowns
    moved = along[before] - (variance @ coupling)[after][:, own]
    where = np.broadcast_to(columns(estimate, equations.record)[before][:, None], moved.shape)
    slope = np.zeros((*moved.shape[:2], len(reduced.active)))
    np.put_along_axis(slope, where, moved, axis=2)
    slope = slope.reshape(-1, len(reduced.active))[:, reduced.active]
    of_others = covariance(reduced.hessian[np.ix_(reduced.active, reduced.active)])
    return joint.reshape(len(slope), len(slope)) + slope @ of_others @ slope.T


def sound_windows(fitted: Fitted) -> np.ndarray:
    """(windows,) bool: fitted as most are."""
    cost = fitted.outcome.equations.cost
    return np.isfinite(cost) & (cost <= _ASTRAY * np.median(cost))


def _neighbours(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Windows that end where another one begins, and these; both fitted as most are."""
    prepared, sound = fitted.prepared, sound_windows(fitted)
    first = np.concatenate([group.first for group in prepared.groups])
    end = first + np.concatenate([group.lengths for group in prepared.groups])
    begins = {(record, start): window for window, (record, start) in enumerate(zip(prepared.record, first, strict=True))}
    pairs = [(window, begins[key]) for window, key in enumerate(zip(prepared.record, end, strict=True)) if key in begins]
    found = np.array([(left, right) for left, right in pairs if sound[left] and sound[right]], int).reshape(-1, 2)
    return found[:, 0], found[:, 1]
