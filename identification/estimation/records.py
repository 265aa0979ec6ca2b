"""Records with their predictions, assembled from the windows."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from identification.least_squares.fit import as_arrays, on_device
from identification.least_squares.residual import predict
from identification.result.result import NO_WINDOW, Nuisance, RecordFit
from identification.windows.layout import GAP_ERROR, NUISANCES, Estimate, Layout
from identification.windows.measured_input import driving_channels
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows
from vibrojax.channels import EVERY_CHANNEL, UNITS
from vibrojax.compiling import soon_compiled
from vibrojax.integrate import SUCCESS, AbstractBatchIntegrator

_UNITS = {"base_amplitude": "m", "base_phase": "rad", "gap_error": "m"}


@soon_compiled
def _predict(model, layout, integrator: AbstractBatchIntegrator, windows: Windows, local):
    return predict(model, layout, integrator, windows, local)


def record_fits(prepared: Prepared, integrator: AbstractBatchIntegrator, estimate: Estimate, errors: np.ndarray) -> tuple[RecordFit, ...]:
    """One `RecordFit` per record; `errors` are the standard errors of the nuisances, (records, nuisances), NaN where not estimated."""
    names = ("relative_velocity", "in_contact", "window")
    series = [{name: np.full(len(record.time), np.nan) for name in (*EVERY_CHANNEL, *names)} for record in prepared.experiment.records]
    for values in series:
        values["window"][:] = NO_WINDOW
    model, begin = as_arrays(prepared.model), 0
    for group in prepared.groups:
        windows = range(begin, begin + len(group.record))
        begin += len(group.record)
        everything = dataclasses.replace(on_device(group), channels=EVERY_CHANNEL)
        local = jnp.asarray(estimate.local(prepared.record)[windows.start : windows.stop])
        predicted, trajectory = jax.tree.map(np.asarray, _predict(model, prepared.layout, integrator, everything, local))
        for lane, window in enumerate(windows):
            target, part = series[group.record[lane]], slice(group.first[lane], group.first[lane] + group.lengths[lane])
            values = dict(zip(EVERY_CHANNEL, predicted[lane].T, strict=True))
            values |= {"relative_velocity": trajectory.v[lane], "in_contact": trajectory.in_contact[lane]}
            for name, column in values.items() if trajectory.result[lane] == SUCCESS else ():
                target[name][part] = column[: group.lengths[lane]]
            target["window"][part] = window
    return tuple(_record_fit(prepared, index, values, estimate, errors[index]) for index, values in enumerate(series))


def _record_fit(prepared: Prepared, index: int, values: dict[str, np.ndarray], estimate: Estimate, errors: np.ndarray) -> RecordFit:
    record, nuisances = prepared.experiment.records[index], estimate.nuisances[index]
    inputs = driving_channels(record)
    fitted = [name for name in EVERY_CHANNEL if name in record.channels and name not in inputs]
    inside = values["window"] != NO_WINDOW
    residual = {name: _residual(record.channels[name][inside], values[name][inside]) for name in fitted}
    return RecordFit(
        file=record.file,
        kind=record.kind,
        gap=record.gap + nuisances[GAP_ERROR],
        nuisances=_nuisances(prepared.layout, nuisances, errors),
        time=record.time,
        measured={name: record.channels[name] for name in EVERY_CHANNEL if name in record.channels},
        predicted={name: values[name] for name in EVERY_CHANNEL},
        noise=dict(record.noise),
        nrmse={name: _over(_rms(r), float(np.nanstd(record.channels[name][inside]))) for name, r in residual.items()},
        chi2_reduced={name: float((_rms(r) / record.noise[name]) ** 2) for name, r in residual.items()},
        relative_displacement=values["relative_displacement"],
        relative_velocity=values["relative_velocity"],
        in_contact=values["in_contact"] > 0,
        window=values["window"].astype(int),
        notices=(*record.notices, *_left_out(inside)),
    )


def _left_out(inside: np.ndarray) -> tuple[str, ...]:
    """What is to be said where not all samples were taken."""
    if inside.all():
        return ()
    return (f"{inside.sum()} of {len(inside)} samples are taken, in windows spread evenly; a part that `crop` chooses is taken whole.",)


def _nuisances(layout: Layout, values: np.ndarray, errors: np.ndarray) -> tuple[Nuisance, ...]:
    """Nuisances estimated for one record, SI; `values` and `errors` in the coordinates of the fit."""
    of_zeros, of_variations = [scale for _, scale in layout.zeros], [std for _, std in layout.variations]
    scales = [1.0] * len(NUISANCES) + of_zeros + of_variations + [p.scale for p in layout.record_parameters]
    units = [*(_UNITS[name] for name in NUISANCES), *(UNITS[channel] for channel, _ in layout.zeros), *["1"] * len(of_variations)]
    units += [p.unit for p in layout.record_parameters]
    rows = zip(layout.nuisances, units, scales, values, errors, strict=True)
    return tuple(
        Nuisance(name=name, unit=unit, value=float(value * scale), stderr=float(error * scale))
        for name, unit, scale, value, error in rows
        if np.isfinite(error)
    )


def _residual(measured: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Measured less predicted values; where the prediction failed, the channel's mean is the prediction."""
    return np.where(np.isfinite(predicted), measured - predicted, measured - np.nanmean(measured))


def _over(error: float, spread: float) -> float:
    """An error over the channel's standard deviation; NaN for a constant channel."""
    return float(error / spread) if spread > 0.0 else np.nan


def _rms(values: np.ndarray) -> float:
    """Root mean square of the finite values."""
    return float(np.sqrt(np.nanmean(values**2)))
