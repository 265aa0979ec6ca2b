"""Prediction errors of a model on what was left out of its fit: held-back records, or windows (cross-validation)."""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.estimation.held_back import SIGNAL, held_back_fits, rms_nrmse
from identification.experiment import Experiment
from identification.least_squares.block_arrow import Equations, reduce, solve
from identification.least_squares.fit import bounds, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import settle
from identification.least_squares.priors import with_prior, without_windows
from identification.likelihood.fitted import Fitted
from identification.likelihood.linearised import Linearised, linearised
from identification.result.result import RecordFit
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, windows_of

FOLDS = 4
_LOST = 4.0
"""Upper limit of a channel's normalised mean squared error, for predictions that diverge."""


class Predictions:
    """Errors of each model on what was left out of its fit, computed once per model: of held-back records, and of windows (`held_out`)."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._windows: dict[int, tuple[Fitted, float]] = {}
        self._records: dict[int, tuple[Fitted, tuple[RecordFit, ...]]] = {}

    def windows(self, fitted: Fitted) -> float:
        """Error on windows left out of the fit."""
        if id(fitted) not in self._windows:
            self._windows[id(fitted)] = fitted, held_out(fitted)
        return self._windows[id(fitted)][1]

    def records(self, fitted: Fitted) -> tuple[RecordFit, ...]:
        """Predictions of the held-back records."""
        if id(fitted) not in self._records:
            self._records[id(fitted)] = fitted, held_back_fits(self._experiment, fitted.model)
        return self._records[id(fitted)][1]

    def __call__(self, fitted: Fitted) -> float:
        """Error on the held-back records, where there are any; else on windows left out of the fit."""
        unseen = self.records(fitted)
        return rms_nrmse(unseen) if unseen else self.windows(fitted)


def held_out(fitted: Fitted) -> float:
    """Cross-validated error: rms error beyond the noise on windows left out of the fit, over the standard deviation of the record.

    Every fourth window is predicted by the fit to the other three, in turn. A window's initial state is refitted, and no random force acts.
    One Gauss-Newton step from the full fit gives the fit without a fold. Fewer windows than folds are left out one by one; for a single
    window the result is NaN. The result is the root mean square over channels and records; the excess of each channel is at least the
    sampling error sqrt(2 / samples) of its noise variance.
    """
    prepared = fitted.prepared
    folds = min(FOLDS, len(prepared.record))
    if folds < 2:
        return float("nan")
    fold, residual = np.arange(len(prepared.record)) % folds, np.zeros_like(fitted.point.at.residual)
    for left_out in range(folds):
        mine = np.flatnonzero(fold == left_out)
        part, estimate = windows_of(prepared, mine), _fitted_without(fitted, mine)
        settled, _ = settle(lambda at, part=part: _equations(part, _along(fitted, part, at), at), estimate, iterations=2)
        at = _along(fitted, part, settled)
        columns = np.array([fitted.point.at.channels.index(name) for name in at.channels])
        residual[np.ix_(mine, np.arange(at.ts.shape[1]), columns)] = np.where(at.finite[:, None, None], at.residual, np.inf)
    return _nrmse(fitted, residual)


def _fitted_without(fitted: Fitted, left_out: np.ndarray) -> Estimate:
    """Estimate from all windows but some (one Gauss-Newton step), with the states of the left-out windows and no random force."""
    estimate, (low, high) = fitted.estimate, bounds(fitted.prepared)
    kept = without_windows(fitted.posterior.equations, fitted.prepared.layout, estimate, left_out)
    shared, nuisances, _ = solve(reduce(kept, estimate, free_unknowns(fitted.prepared), 1e-9), kept, estimate)
    return dataclasses.replace(
        estimate,
        shared=np.clip(estimate.shared + shared, low, high),
        nuisances=estimate.nuisances + nuisances,
        states=estimate.states[left_out],
        force=np.zeros_like(estimate.force[left_out]),
    )


def _along(fitted: Fitted, part: Prepared, estimate: Estimate) -> Linearised:
    """Selected windows linearised at an estimate, with the integration steps of the full fit, for which a compiled program exists."""
    return linearised(part, integrator_for(fitted.prepared), estimate, fitted.variances.places)


def _equations(part: Prepared, at: Linearised, estimate: Estimate) -> Equations:
    """Normal equations of the windows under white noise."""
    rows, residual = at.jacobian.reshape(*at.jacobian.shape[:2], -1), at.residual.reshape(len(at.record), -1)
    found = Equations(
        hessian=rows @ rows.transpose(0, 2, 1),
        gradient=np.einsum("lis,ls->li", rows, residual),
        cost=np.where(at.finite, 0.5 * np.sum(residual**2, axis=1), np.inf),
        record=at.record,
    )
    return with_prior(found, part.layout, estimate)


def _nrmse(fitted: Fitted, residual: Float[np.ndarray, "windows time channels"]) -> float:
    """Normalised error from residuals over the stated noise, less the noise variance."""
    at, parts = fitted.point.at, []
    for index in np.unique(at.record):
        record = fitted.prepared.experiment.records[index]
        for column, channel in enumerate(at.channels):
            counted = (at.weight[..., column] > 0) & (at.record == index)[:, None]
            if not counted.any():
                continue
            square = residual[..., column][counted] ** 2
            beyond = max(float(square.mean()) - 1.0, float(np.sqrt(2.0 / len(square))))
            signal = float(np.nanvar(record.channels[channel])) / record.noise[channel] ** 2
            if signal > SIGNAL:
                parts.append(min(beyond / signal, _LOST))
    return float(np.sqrt(np.mean(parts))) if parts else float("nan")
