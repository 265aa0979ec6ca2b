"""How well a model predicts windows that it was not fitted to."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from identification.block_arrow import Equations, reduce, solve
from identification.fit import CHUNK, as_arrays, bounds, evaluator, free_unknowns, integrator_for, on_device
from identification.lanes import chunked
from identification.levenberg_marquardt import settle
from identification.likelihood.fitted import Fitted
from identification.prepare import windows_of
from identification.residual import residuals

FOLDS = 4
SIGNAL = 9.0
"""Variance of a channel over that of its noise below which it holds nothing to predict."""
_LOST = 4.0
"""Mean square error over variance at which a prediction is as bad as any."""


def held_out(fitted: Fitted) -> float:
    """Error on windows left out of the fit: rms beyond the noise over the standard deviation of the record.

    Every fourth window is predicted by the fit to the other three, in turn; a window's initial state is its own, and no random force acts.
    What the fit would be without a fold follows by one Gauss-Newton step from the whole fit, which lies close by. Fewer windows than folds
    are left out one by one; of a single window nothing can be left out, and its error is not a number. The root of the mean square over
    channels and records; not below what so many samples can tell from noise.
    """
    if len(fitted.prepared.record) < 2:
        return float("nan")
    prepared, estimate = fitted.prepared, fitted.estimate
    equations, (low, high) = fitted.posterior.equations, bounds(prepared)
    folds = min(FOLDS, len(prepared.record))
    fold = np.arange(len(prepared.record)) % folds
    states, shared, nuisances = estimate.states.copy(), [], []
    for left_out in range(folds):
        kept = _without(equations, fold == left_out)
        step, step_nuisances, _ = solve(reduce(kept, estimate, free_unknowns(prepared), 1e-9), kept, estimate)
        at = dataclasses.replace(estimate, shared=np.clip(estimate.shared + step, low, high), nuisances=estimate.nuisances + step_nuisances)
        mine = np.flatnonzero(fold == left_out)
        alone = evaluator(windows_of(prepared, mine), integrator_for(prepared))
        settled, _ = settle(alone, dataclasses.replace(at, states=at.states[mine]), iterations=2)
        states[mine] = settled.states
        shared.append(at.shared)
        nuisances.append(at.nuisances)
    local = np.stack([_vector(shared[k], nuisances[k][r], s) for k, r, s in zip(fold, prepared.record, states, strict=True)])
    return _nrmse(fitted, local)


def _without(equations: Equations, left_out: np.ndarray) -> Equations:
    """The windows that are kept; the others' states have nothing to say."""
    keep = ~left_out
    return dataclasses.replace(
        equations,
        hessian=equations.hessian * keep[:, None, None],
        gradient=equations.gradient * keep[:, None],
        cost=np.where(keep, equations.cost, 0.0),
    )


def _vector(shared: np.ndarray, nuisances: np.ndarray, states: np.ndarray) -> np.ndarray:
    return np.concatenate([shared, nuisances, states])


def _nrmse(fitted: Fitted, local: np.ndarray) -> float:
    """From the residuals of all windows at their own vectors; the noise, as stated, is taken off."""
    prepared, integrator = fitted.prepared, integrator_for(fitted.prepared)
    model, layout = as_arrays(prepared.model), prepared.layout
    squares: dict[tuple[int, str], list[np.ndarray]] = {}
    for lanes, windows in chunked(prepared.groups, CHUNK):
        found = np.asarray(residuals(model, layout, integrator, on_device(windows), jnp.asarray(local[lanes]))[0])
        for lane, row in zip(*np.unique(lanes, return_index=True), strict=True):  # a chunk is filled up with copies
            for column, channel in enumerate(windows.channels):
                counted = windows.weight[row, :, column] > 0
                if counted.any():
                    squares.setdefault((int(prepared.record[lane]), channel), []).append(
                        np.clip(found[row, counted, column], -1e6, 1e6) ** 2
                    )
    parts = []
    for (index, channel), values in squares.items():
        record, square = prepared.experiment.records[index], np.nan_to_num(np.concatenate(values), nan=1e6)
        beyond = max(float(square.mean()) - 1.0, float(np.sqrt(2.0 / len(square))))
        signal = float(np.nanvar(record.channels[channel])) / record.noise[channel] ** 2
        if signal > SIGNAL:
            parts.append(min(beyond / signal, _LOST))
    return float(np.sqrt(np.mean(parts))) if parts else float("nan")
