"""One-step errors of a fitted chain: each reading less what all earlier ones predict, over the standard deviation of that.

The states given the readings of earlier segments are filtered in information form; a segment's readings have the covariance J P J' + 1
about their prediction, with J their whitened derivative, and its Cholesky factor makes them independent of each other, in the order of
time. Parameters are those of the estimate. Where physics and variances are right, these errors are white, with variance one.

Source: A. C. Harvey, Forecasting, structural time series models and the Kalman filter (1989), section 5.4 (diagnostics by standardised
innovations); T. Kailath, IEEE Trans. Autom. Control 13 (1968) 646-655.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from identification.trajectory.chain_equations import motion_covariance, whitened_rows, whitenings
from identification.trajectory.fit import Fitted


def innovations(fitted: Fitted) -> Float[np.ndarray, "segments samples channels"]:
    """Standardised one-step errors, NaN where no sample counts."""
    problem, chains, linear = fitted.problem, fitted.problem.chains, fitted.linear
    size, segments = len(problem.unknowns.states) + 1, len(chains.left)
    inside, force, scales = 3 * size, fitted.variances.force, problem.scales
    motion, drive = _motion_alone(fitted)
    white = whitenings(chains, linear, fitted.variances.readings)
    parts = list(whitened_rows(chains, problem.unknowns, problem.border, linear, white))
    rows = np.stack([one[..., :inside] for one, _ in parts], axis=2).reshape(segments, -1, inside)
    errors = np.stack([one for _, one in parts], axis=2).reshape(segments, -1)
    counted = np.stack([one.scale > 0 for one in white], axis=2).reshape(segments, -1)
    found = np.full(counted.shape, np.nan)
    wide, unknown = np.concatenate([scales.widest, [force.std]]) ** -2.0, scales.unknown**-2.0
    precision, gradient = np.zeros((inside, inside)), np.zeros(inside)
    ahead = np.empty((segments, inside, inside)), np.empty((segments, inside))
    for k in range(segments):
        precision, gradient = _later(precision, gradient, size)
        begins = chains.first[k]
        if begins:
            precision, gradient = np.diag(np.concatenate([np.ones(size), wide, np.zeros(size)])), np.zeros(inside)
            gradient[2 * size - 1] = fitted.at.force[chains.left[k]] / force.std**2
            gradient[size + 2 : 2 * size - 1] = fitted.at.states[chains.left[k], 2:] * wide[2:-1]
        elif not fitted.local.linked[k - 1]:
            states = np.arange(size, 2 * size - 1)
            precision[states, states] += unknown
        precision, gradient = precision + motion[k], gradient + drive[k]
        if not fitted.local.linked[k]:
            states = np.arange(2 * size, 3 * size - 1)
            precision[states, states] += unknown
        ahead[0][k], ahead[1][k] = precision, gradient
        precision = precision + fitted.local.gram[k, :inside, :inside]
        gradient = gradient + fitted.local.right[k, :inside]
    for begin in range(0, segments, 512):  # covariances that memory holds at once
        part = slice(begin, begin + 512)
        found[part] = _standardised(rows[part], errors[part], ahead[0][part], ahead[1][part])
    found[~counted] = np.nan
    return found.reshape(segments, chains.samples, -1)


def _standardised(
    rows: Float[np.ndarray, "segments readings inside"],
    errors: Float[np.ndarray, "segments readings"],
    precision: Float[np.ndarray, "segments inside inside"],
    gradient: Float[np.ndarray, "segments inside"],
) -> Float[np.ndarray, "segments readings"]:
    """Readings less their prediction from earlier segments, in units of the Cholesky factor of its covariance."""
    scale, rounding = 1.0 / np.sqrt(np.diagonal(precision, axis1=1, axis2=2)), 1e-13
    factor = np.linalg.cholesky(precision * scale[:, :, None] * scale[:, None, :] + rounding * np.eye(rows.shape[-1]))
    half = np.linalg.solve(factor, np.concatenate([rows.swapaxes(1, 2), gradient[..., None]], axis=2) * scale[..., None])
    by = half[..., :-1].swapaxes(1, 2)
    off = errors[..., None] - by @ half[..., -1:]
    return np.linalg.solve(np.linalg.cholesky(by @ half[..., :-1] + np.eye(rows.shape[1])), off)[..., 0]


def _motion_alone(fitted: Fitted) -> tuple[Float[np.ndarray, "segments inside inside"], Float[np.ndarray, "segments inside"]]:
    """Information and gradient of three knots by the equations of motion and of the random force."""
    problem, chains, at, force, local = fitted.problem, fitted.problem.chains, fitted.at, fitted.variances.force, fitted.local
    inside, size = 3 * (len(problem.unknowns.states) + 1), len(problem.unknowns.states) + 1
    weight = np.linalg.inv(motion_covariance(chains, problem.scales, force, problem.mass(fitted.at)))
    rows = local.defect[..., :inside]
    turned = rows.swapaxes(1, 2) @ weight
    gram, right = turned @ rows, (turned @ local.gap[..., None])[..., 0]
    correlation, variance = force.step(chains.duration)
    ends = np.zeros((len(chains.left), inside))
    ends[:, 2 * size - 1], ends[:, 3 * size - 1] = -correlation, 1.0
    jump = at.force[chains.left + 1] - correlation * at.force[chains.left]
    gram += ends[:, :, None] * ends[:, None, :] / variance[:, None, None]
    return gram, right + ends * (jump / variance)[:, None]


def _later(precision: np.ndarray, gradient: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Information of three knots, the first one eliminated, and room for one more."""
    found, onward = np.zeros_like(precision), np.zeros_like(gradient)
    if precision.any():
        head, rest = slice(0, size), slice(size, None)
        solved = np.linalg.solve(precision[head, head], np.column_stack([precision[head, rest], gradient[head]]))
        found[: 2 * size, : 2 * size] = precision[rest, rest] - precision[rest, head] @ solved[:, :-1]
        onward[: 2 * size] = gradient[rest] - precision[rest, head] @ solved[:, -1]
    return found, onward


@dataclasses.dataclass(frozen=True, kw_only=True)
class Whiteness:
    """Of the one-step errors of a channel.

    Attributes:
        variance: about zero; 1 where physics and variances are right.
        correlations: at 1 to 4 samples where there are such pairs; 0 there, with a standard error of samples^(-1/2).
        samples: count of errors.
    """

    variance: float
    correlations: tuple[float, ...]
    samples: int


def autocorrelation(series: Sequence[np.ndarray], lags: int) -> Float[np.ndarray, " lags"]:
    """Mean product of values so many samples apart over their mean square; all series together, gaps left out; NaN without such pairs.

    Example:
        >>> autocorrelation([np.array([1.0, -1.0, 1.0, -1.0])], 1).round(2).tolist()
        [1.0, -1.0]
    """
    products = [[one[lag:] * one[: len(one) - lag] for one in series if len(one) > lag] for lag in range(lags + 1)]
    means = np.array([np.nanmean(np.concatenate(p)) if p and np.isfinite(np.concatenate(p)).any() else np.nan for p in products])
    return means / means[0] if means[0] > 0.0 else np.full(lags + 1, np.nan)  # nothing is left over, or nothing was recorded


def whiteness(fitted: Fitted) -> dict[str, Whiteness]:
    """Variance and correlations of the one-step errors by channel, all records together."""
    chains, found, errors = fitted.problem.chains, {}, innovations(fitted)
    for c, name in enumerate(chains.channels):
        series = [errors[chains.of_record(r), :, c].ravel() for r in range(len(chains.files))]
        values = np.concatenate(series)
        count = int(np.isfinite(values).sum())
        if count == 0:
            continue
        correlations = tuple(one for one in autocorrelation(series, 4)[1:].tolist() if np.isfinite(one))
        found[name] = Whiteness(variance=float(np.nanmean(values**2)), correlations=correlations, samples=count)
    return found
