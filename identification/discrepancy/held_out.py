"""How well a model predicts windows that it was not fitted to."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from identification.block_arrow import Equations, reduce, solve
from identification.discrepancy.refit import Fitted
from identification.fit import as_arrays, evaluator, free_unknowns, integrator_for, on_device
from identification.lanes import chunked
from identification.levenberg_marquardt import settle
from identification.residual import residuals

FOLDS = 4
_CHUNK = 16


@dataclasses.dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Errors on windows that were left out of the fit.

    Attributes:
        nrmse: rms error over standard deviation of the record, root of the mean square over channels and records.
        chi2: sum of squared residuals over the noise variance of all windows, each predicted by the fit to the others.
    """

    nrmse: float
    chi2: float


def held_out(fitted: Fitted) -> HeldOut:
    """Every fourth window is predicted by the fit to the other three, in turn; a window's initial state is its own.

    What the fit would be without a fold follows by one Gauss-Newton step from the whole fit, which lies close by.
    """
    prepared, estimate, equations = fitted.prepared, fitted.outcome.estimate, fitted.outcome.equations
    fold = np.arange(len(prepared.record)) % FOLDS
    evaluate = evaluator(prepared, integrator_for(prepared))
    states, shared, nuisances = estimate.states.copy(), [], []
    chi2 = 0.0
    for left_out in range(FOLDS):
        kept = _without(equations, fold == left_out)
        step, step_nuisances, _ = solve(reduce(kept, estimate, free_unknowns(prepared), 1e-9), kept, estimate)
        at = dataclasses.replace(estimate, shared=estimate.shared + step, nuisances=estimate.nuisances + step_nuisances)
        settled, cost = settle(evaluate, at, iterations=2)
        chi2 += 2.0 * float(cost[fold == left_out].sum())
        states[fold == left_out] = settled.states[fold == left_out]
        shared.append(at.shared)
        nuisances.append(at.nuisances)
    local = np.stack([_vector(shared[k], nuisances[k][r], s) for k, r, s in zip(fold, prepared.record, states, strict=True)])
    return HeldOut(nrmse=_nrmse(fitted, local), chi2=chi2)


def _without(equations: Equations, left_out: np.ndarray) -> Equations:
    """The windows that are kept; the others' states have nothing to say."""
    keep = ~left_out
    return dataclasses.replace(
        equations,
        hessian=equations.hessian * keep[:, None, None],
        gradient=equations.gradient * keep[:, None],
        cost=equations.cost * keep,
    )


def _vector(shared: np.ndarray, nuisances: np.ndarray, states: np.ndarray) -> np.ndarray:
    return np.concatenate([shared, nuisances, states])


def _nrmse(fitted: Fitted, local: np.ndarray) -> float:
    """From the residuals of all windows at their own vectors."""
    prepared, integrator = fitted.prepared, integrator_for(fitted.prepared)
    model, layout = as_arrays(prepared.model), prepared.layout
    squares: dict[tuple[int, str], list[float]] = {}
    for lanes, windows in chunked(prepared.groups, _CHUNK):
        found = np.asarray(residuals(model, layout, integrator, on_device(windows), jnp.asarray(local[lanes]))[0])
        for row, lane in enumerate(lanes):
            for column, channel in enumerate(windows.channels):
                weight = windows.weight[row, :, column]
                if weight.any():
                    r = found[row, :, column][weight > 0] / weight[weight > 0]
                    squares.setdefault((int(prepared.record[lane]), channel), []).extend(np.clip(r, -1e3, 1e3) ** 2)
    parts = [
        np.mean(values) / max(float(np.nanvar(prepared.experiment.records[record].channels[channel])), 1e-300)
        for (record, channel), values in squares.items()
        if channel in prepared.experiment.records[record].channels
        and np.nanstd(prepared.experiment.records[record].channels[channel]) > 3 * prepared.experiment.records[record].noise[channel]
    ]
    return float(np.sqrt(np.mean(parts))) if parts else float("nan")
