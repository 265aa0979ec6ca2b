"""Missing force: the force on the hammer that the fitted model does not explain, along every record."""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.diagnosis.score.time_scales import resolution
from identification.likelihood.linearised import Linearised
from identification.likelihood.response import Perturbation, response
from identification.windows.prepare import Prepared

_KNOT_SPACING = 4.0
"""Knot spacing of a force inferred from displacement alone, over the half width of a local average."""
_MOST_KNOTS = 32
_STRENGTHS = np.geomspace(1e-3, 1e2, 11)
"""Prior standard deviations of that force, relative to the smallest force that one window shows."""
_CURVATURES = (0.0, 1.0, 10.0)
"""Prior weight of the second difference from knot to knot, relative to the force itself."""
_LEAST_CUT, _ORDERLY = 4.0, 0.3
"""Smallest threshold of the mean squared residual above which a window is down-weighted; share of the windows that sets the threshold."""
_MOTION = ("relative_displacement", "hammer_displacement")


def missing_force(
    prepared: Prepared, at: Linearised, mass: float
) -> tuple[Float[np.ndarray, "windows time"], Float[np.ndarray, "windows time"]] | None:
    """Force towards the stop that acts on the hammer beside the fitted model, N, and its standard error.

    With recorded acceleration: m (x''_recorded - x''_model), less the contribution of the difference in u and u', averaged over 3 ms, or
    less where contacts or vibrations are shorter. Elsewhere: the piecewise linear force whose response along the fitted motion, with a free
    initial state, explains the residuals of all channels best under a Gaussian prior. The strength of the prior is that of highest marginal
    likelihood over all windows. The standard error of windows that the fit down-weights grows by sqrt(x / cut). Where nothing is known, the
    force is 0 and its error infinite. None where neither acceleration nor displacement of the hammer was recorded.

    Source: variation of constants (`response`); marginal likelihood as D. J. C. MacKay, Neural Computation 4 (1992) 415-447.
    """
    recorded = {name: at.weight[..., index] > 0 for index, name in enumerate(at.channels)}
    accelerations = recorded.get("hammer_acceleration", np.zeros(at.ts.shape, bool))
    moved = np.zeros(at.ts.shape, bool)
    for name in _MOTION:
        moved |= recorded.get(name, moved)
    if not (accelerations.any() or moved.any()):
        return None
    direct, half = accelerations.sum(axis=1) > 0.5 * at.lengths, resolution(at)
    force, stderr = np.zeros_like(at.ts), np.full_like(at.ts, np.inf)
    weights = window_weights(at)
    if direct.any():
        force[direct], deviation = _from_acceleration(prepared, _only(at, direct), mass, half)
        stderr[direct] = deviation / np.sqrt(np.maximum(weights[direct], 1e-12))[:, None]
    smoothed = ~direct & moved.any(axis=1)
    if smoothed.any():
        hats = _hats(_only(at, smoothed), _KNOT_SPACING * half)
        force[smoothed], stderr[smoothed] = _smoother(prepared, _only(at, smoothed), weights[smoothed], mass, hats)
    known = at.inside & at.finite[:, None] & np.isfinite(force) & (stderr > 0)
    return np.where(known, force, 0.0), np.where(known, stderr, np.inf)


def window_cost(at: Linearised) -> Float[np.ndarray, " windows"]:
    """Half the sum of squared residuals of every window; infinite where it could not be integrated."""
    return np.where(at.finite, 0.5 * np.sum(np.where(at.weight > 0, at.residual, 0.0) ** 2, axis=(1, 2)), np.inf)


def window_weights(at: Linearised) -> Float[np.ndarray, " windows"]:
    """Weight of each window: 1, below 1 where its mean squared residual exceeds the threshold, 0 where the integration failed."""
    samples = (at.weight > 0).sum(axis=(1, 2))
    each = np.where(at.finite, 2.0 * np.where(at.finite, window_cost(at), 0.0) / np.maximum(samples, 1), np.inf)
    cut = max(_LEAST_CUT, 2.0 * float(np.quantile(np.where(at.finite, each, 1e12), _ORDERLY)))
    return np.minimum(1.0, cut / np.maximum(each, 1e-300))


def _only(at: Linearised, chosen: np.ndarray) -> Linearised:
    """The selected windows."""
    if chosen.all():
        return at
    arrays = {f.name: getattr(at, f.name)[chosen] for f in dataclasses.fields(at) if f.name != "channels"}
    return Linearised(channels=at.channels, **arrays)


def _from_acceleration(prepared: Prepared, at: Linearised, mass: float, resolved: float) -> tuple[np.ndarray, np.ndarray]:
    """Missing force and its error in windows with recorded acceleration; `resolved` is the half width of local averages, s."""
    half = max(1, round(resolved / _interval(at)))
    difference, weight = _in_si(at, "hammer_acceleration")
    difference, variance = _local_mean(difference, weight, half)
    (du, dv), (var_u, var_v) = _deviation(prepared, at, half)
    for moved, noise, slope in ((du, var_u, at.restoring[..., 0]), (dv, var_v, at.restoring[..., 1])):
        steep, square = _running(slope, half), _running(slope**2, half)
        difference = difference - steep * moved
        variance = variance + square * noise
    return mass * difference, mass * np.sqrt(variance)


def _deviation(prepared: Prepared, at: Linearised, half: int) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Recorded less modelled (u, u') where displacement was recorded, else zero; and their variances."""
    recorded = [name for name in _MOTION if name in at.channels and (at.weight[..., at.channels.index(name)] > 0).any()]
    if not recorded:
        spread = _state_spread(prepared, at)
        return (np.zeros_like(at.u), np.zeros_like(at.u)), (spread[..., 0], spread[..., 1])
    moved, weight = _in_si(at, recorded[0])
    if recorded[0] == "hammer_displacement" and "cart_displacement" in at.channels:
        cart, of_cart = _in_si(at, "cart_displacement")
        both = _variance(weight) + _variance(of_cart)
        moved, weight = moved - cart, np.where(weight > 0, 1.0 / np.sqrt(np.where(both > 0, both, 1.0)), 0.0)
    mean, variance = _local_mean(moved, weight, half)
    slope, of_slope = _local_slope(moved, weight, half, _interval(at))
    return (mean, slope), (variance, of_slope)


def _state_spread(prepared: Prepared, at: Linearised) -> np.ndarray:
    """Variance of the modelled (u, u') due to uncertain initial states, (windows, time, 2)."""
    of_state = np.linalg.pinv(_states(prepared, at) @ _states(prepared, at).transpose(0, 2, 1), hermitian=True)
    motion = at.fundamental[..., :2, :]
    return np.einsum("ltai,lij,ltaj->lta", motion, of_state, motion)


def _in_si(at: Linearised, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Recorded less modelled values in SI, 0 where not recorded, and the weight 1 / noise."""
    channel = at.channels.index(name)
    weight = at.weight[..., channel]
    return np.where(weight > 0, at.residual[..., channel] / np.where(weight > 0, weight, 1.0), 0.0), weight


def _variance(weight: np.ndarray) -> np.ndarray:
    """Noise variance of every recorded sample, 0 elsewhere."""
    return np.where(weight > 0, 1.0 / np.where(weight > 0, weight, 1.0) ** 2, 0.0)


def _interval(at: Linearised) -> float:
    """Sampling interval, s."""
    return float(np.median(np.diff(at.ts[:, : max(2, int(at.lengths.min()))], axis=1)))


def _sums(values: np.ndarray, half: int) -> np.ndarray:
    """Sum over 2 half + 1 neighbours, fewer at the ends of a window."""
    padded = np.pad(np.cumsum(values, axis=1), [(0, 0), (1, 0)])
    last = values.shape[1]
    high, low = np.minimum(np.arange(last) + half + 1, last), np.maximum(np.arange(last) - half, 0)
    return padded[:, high] - padded[:, low]


def _running(values: np.ndarray, half: int) -> np.ndarray:
    """Mean over 2 half + 1 neighbours, fewer at the ends of a window."""
    return _sums(values, half) / _sums(np.ones_like(values), half)


def _local_mean(values: np.ndarray, weight: np.ndarray, half: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the recorded neighbours and its variance, infinite where none was recorded."""
    count = _sums((weight > 0).astype(float), half)
    few = np.maximum(count, 1.0)
    noise = _sums(_variance(weight), half)
    return _sums(values, half) / few, np.where(count > 0.5, noise / few**2, np.inf)


def _local_slope(values: np.ndarray, weight: np.ndarray, half: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Slope of the straight line through the recorded neighbours, per s, and its variance."""
    use, index = (weight > 0).astype(float), np.arange(values.shape[1], dtype=float)
    count, first, second = _sums(use, half), _sums(use * index, half), _sums(use * index**2, half)
    few = np.maximum(count, 1.0)
    spread = second - first**2 / few
    safe = np.maximum(spread, 0.5)
    slope = (_sums(values * index, half) - first / few * _sums(values, half)) / safe
    noise = _sums(_variance(weight), half) / few
    return np.where(spread > 0.5, slope, 0.0) / dt, np.where(spread > 0.5, noise / safe, np.inf) / dt**2


def _states(prepared: Prepared, at: Linearised) -> np.ndarray:
    """Derivative of the residual with respect to every window's initial state, (windows, states, time * channels)."""
    begin = prepared.layout.size - prepared.layout.states
    return at.jacobian[:, begin:].reshape(len(at.record), prepared.layout.states, -1)


def _smoother(prepared: Prepared, at: Linearised, weights: np.ndarray, mass: float, hats: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Posterior mean and standard deviation of a force that is a sum of `hats`, in windows without recorded acceleration."""
    root = np.sqrt(weights)[:, None]
    none = np.zeros_like(at.u)
    columns = []
    for knot in range(hats.shape[-1]):
        push = Perturbation(
            force=hats[..., knot], stop_position=none, stop_velocity=none, base_displacement=none, base_acceleration=none, readings={}
        )
        columns.append(-response(at, mass, push).reshape(len(root), -1) * root)
    design, residual = np.stack(columns, axis=1), at.residual.reshape(len(root), -1) * root
    states = _states(prepared, at) * root[..., None]
    gram, right = design @ design.transpose(0, 2, 1), np.einsum("lks,ls->lk", design, residual)
    cross, own = design @ states.transpose(0, 2, 1), states @ states.transpose(0, 2, 1)
    taken = cross @ np.linalg.pinv(own, hermitian=True)
    gram = gram - taken @ cross.transpose(0, 2, 1)
    right = right - np.einsum("lks,ls->lk", taken, np.einsum("lst,lt->ls", states, residual))
    prior = _prior(gram, right)
    covariance = np.linalg.inv(gram + prior)
    force = np.einsum("ltk,lkj,lj->lt", hats, covariance, right, optimize=True)
    return force, np.sqrt(np.einsum("ltk,ltk->lt", hats @ covariance, hats))


def _hats(at: Linearised, apart: float) -> np.ndarray:
    """Piecewise linear basis functions of time, 1 N at one knot each, `apart` seconds apart or more; (windows, time, knots)."""
    since = at.ts - at.ts[:, :1]
    longest = float(np.max(np.take_along_axis(since, at.lengths[:, None] - 1, axis=1)))
    spacing = max(apart, 4.0 * _interval(at), longest / (_MOST_KNOTS - 1))
    knots = spacing * np.arange(int(np.ceil(longest / spacing)) + 1)
    return np.clip(1.0 - np.abs(since[..., None] - knots) / spacing, 0.0, None)


def _prior(gram: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Prior precision of the knot forces with the highest marginal likelihood over all windows, from a grid."""
    knots = gram.shape[-1]
    bend = np.diff(np.eye(knots), 2, axis=0)
    known = np.median(np.diagonal(gram, axis1=1, axis2=2).max(axis=1))
    unit = 1.0 / np.sqrt(max(float(known), 1e-300))
    best, found = -np.inf, np.eye(knots)
    for strength in _STRENGTHS * np.sqrt(knots):
        for curvature in _CURVATURES:
            precision = (np.eye(knots) + curvature * bend.T @ bend) / (strength * unit) ** 2
            both = gram + precision
            _, size = np.linalg.slogdet(both)
            _, alone = np.linalg.slogdet(precision)
            gain = np.einsum("lk,lk->l", right, np.linalg.solve(both, right[..., None])[..., 0])
            likelihood = 0.5 * float(np.sum(alone - size + gain))
            if likelihood > best:
                best, found = likelihood, precision
    return found
