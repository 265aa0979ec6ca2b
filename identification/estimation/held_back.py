"""Prediction of held-back records, which enter no fit."""

import dataclasses

import numpy as np

from identification.estimation.records import record_fits
from identification.experiment import Experiment
from identification.least_squares.block_arrow import covariance, reduce
from identification.least_squares.fit import evaluator, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt, Outcome
from identification.least_squares.settling import settled_gradually
from identification.result.result import RecordFit
from identification.windows.layout import Active, Estimate, layout_of
from identification.windows.prepare import MOST_SAMPLES, Prepared, prepare
from identification.windows.windows import WindowLength
from vibrojax.model import MASS, Model

LONG = WindowLength(longest=4096)
"""Window length of held-back records: two impacts, or at most this many samples where there are none; a well-fitted record is one piece."""
SIGNAL = 9.0
"""Ratio of a channel's variance to its noise variance below which the channel holds no signal to predict."""
_SIDE_BY_SIDE = 1
"""Windows per chunk: they are too long and too few to be padded to more."""


def held_back_fits(
    experiment: Experiment, model: Model, *, window: WindowLength = LONG, smoothing: float | None = None
) -> tuple[RecordFit, ...]:
    """Predict every held-back record with a model that was fitted to the others.

    Shared parameters stay fixed. Only the numbers that belong to a record or a window and that no other record identifies are estimated:
    the initial state of every window, amplitude and phase of a sine, the setting error of the gap, and an effect's parameters per record.
    Of long records windows spread evenly are predicted.

    Args:
        experiment: whole, as loaded.
        model: fitted; with or without effects.
        window: length of a stretch predicted from one initial state.
        smoothing: width of the contact switch, m; None for the exact contact.

    Returns:
        One `RecordFit` for each record of `experiment.held_back`, in their order; empty where none is held back. Where the model cannot be
        integrated the prediction is NaN.

    Raises:
        ExperimentError: a held-back record lacks what its kind needs.
    """
    if not experiment.held_back:
        return ()
    records = tuple(dataclasses.replace(record, held_back=False) for record in experiment.held_back)
    held = dataclasses.replace(experiment, records=records, parameters={})
    most = max(MOST_SAMPLES, 2.0 * window.longest * len(records))  # two windows of each at least, so that none is passed over
    prepared = prepare(held, law=model.law.name, window=window, smoothing=smoothing, most_samples=most)
    prepared = _under(prepared, model, weighed=experiment.mass_is_known)
    integrator = integrator_for(prepared)
    evaluate = evaluator(prepared, integrator, side_by_side=_SIDE_BY_SIDE)
    estimate, cost = settled_gradually(prepared, integrator, side_by_side=_SIDE_BY_SIDE)
    active = Active(shared=np.zeros(prepared.layout.shared, bool), nuisances=free_unknowns(prepared).nuisances)
    errors = np.full(estimate.nuisances.shape, np.nan)
    if active.nuisances.any() and np.isfinite(cost).all():
        anywhere = np.full(prepared.layout.shared, np.inf)
        outcome = LevenbergMarquardt()(evaluate, estimate, active, (-anywhere, anywhere))
        estimate = outcome.estimate
        errors = _nuisance_errors(outcome, active)
    return record_fits(prepared, integrator, estimate, errors)


def rms_nrmse(records: tuple[RecordFit, ...]) -> float:
    """Root mean square of the normalised errors over all channels with signal; a failed prediction counts as 1."""
    errors = [error for record in records for channel, error in record.nrmse.items() if _has_signal(record, channel)]
    return float(np.sqrt(np.mean(np.nan_to_num(errors, nan=1.0, posinf=1.0) ** 2))) if errors else float("nan")


def _has_signal(record: RecordFit, channel: str) -> bool:
    """Whether a channel's variance exceeds that of its noise by the factor `SIGNAL`."""
    return bool(np.nanvar(record.measured[channel]) > SIGNAL * record.noise[channel] ** 2)


def _nuisance_errors(outcome: Outcome, active: Active) -> np.ndarray:
    """(records, nuisances) standard errors due to the noise, NaN where not estimated."""
    reduced = reduce(outcome.equations, outcome.estimate, active, 0.0)
    errors = np.full(len(reduced.active), np.nan)
    errors[reduced.active] = np.sqrt(np.diag(covariance(reduced.hessian[np.ix_(reduced.active, reduced.active)])))
    return errors[len(active.shared) :].reshape(active.nuisances.shape)


def _under(prepared: Prepared, model: Model, *, weighed: bool) -> Prepared:
    """The same windows under a fitted model with its parameters; gaps are as set, because guessed gap errors belong to the guessed law."""
    layout = layout_of(model, *(() if weighed else (MASS,)), files=prepared.layout.files, zeros=prepared.layout.zeros)
    values = {name: float(value) for name, value in model.values().items()} | {MASS.name: float(model.mass)}
    start = prepared.start
    as_set = start.nuisances * [name != "gap_error" for name in prepared.layout.nuisances]
    more = np.zeros((len(start.nuisances), len(layout.record_parameters)))
    own = np.zeros((len(start.states), len(layout.free_own)))
    return dataclasses.replace(
        prepared,
        model=model,
        layout=layout,
        fixed={},
        start=Estimate(
            shared=layout.internal({p.name: values[p.name] for p in layout.parameters}),
            nuisances=np.concatenate([as_set, more], axis=1),
            states=np.concatenate([start.states, own], axis=1),
        ),
    )
