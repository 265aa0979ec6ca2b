"""The noise of every channel of every record: declared, estimated from the channel itself, or taken from another record."""

from collections.abc import Sequence
from dataclasses import replace
from math import comb, hypot, sqrt

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.experiment import Record, Sensor

MAD_TO_STD = 1.4826022185056018


def estimate_noise(values: Float64[np.ndarray, " samples"]) -> float | None:
    """Estimate the standard deviation of a channel's noise from its 8th differences.

    The noise is taken for white: then an 8th difference has the variance C(16, 8) times that of the noise, while a signal that varies
    slowly against the sampling step cancels in it. The spread is the median absolute deviation, so impacts, which fill few samples, do
    not count. Noise that is correlated over samples (a low-passed channel) is therefore underestimated, and a signal that is poorly
    resolved by the sampling counts as noise. The result is never below the quantisation's own, step / sqrt(12); where the noise is so
    small that most samples just repeat, the step is taken from the smallest changes between neighbours.

    Args:
        values: one channel, any unit, evenly sampled; NaN where not usable.

    Returns:
        The standard deviation in the same unit, above 0; None where the channel is constant or has too few usable samples.

    Example:
        >>> rng = np.random.default_rng(0)
        >>> round(estimate_noise(rng.normal(0.0, 2.0, 20_000)), 1)
        2.0
    """
    differences = np.diff(values, 8) if values.size > 8 else np.empty(0)
    differences = differences[np.isfinite(differences)]
    if differences.size < 8:
        return None
    spread = MAD_TO_STD * float(np.median(np.abs(differences))) / sqrt(comb(16, 8))
    step = _smallest_change(values) if spread == 0.0 else quantisation_step(values)
    estimate = max(spread, step / sqrt(12.0))
    return estimate if estimate > 0.0 and np.isfinite(estimate) else None


def quantisation_step(values: Float64[np.ndarray, " samples"]) -> float:
    """Distance of the closest two levels of a channel, if its samples repeat so often that there are levels; else 0."""
    usable = values[np.isfinite(values)][:1_000_000]
    levels = np.unique(usable)
    return float(np.diff(levels).min()) if 1 < levels.size < 0.5 * usable.size else 0.0


def _smallest_change(values: Float64[np.ndarray, " samples"]) -> float:
    """Typical smallest change between neighbours of a channel that mostly stands still."""
    changes = np.abs(np.diff(values))
    changes = changes[np.isfinite(changes) & (changes > 0.0)]
    return float(np.quantile(changes, 0.05)) if changes.size else 0.0


Estimates = dict[str, float | None]
"""Of the noise of one record, by channel whose noise is not declared."""


def with_noise(records: Sequence[Record], sensors: dict[str, Sensor], *, needed: bool = True) -> tuple[Record, ...]:
    """Fill in `noise` and `noise_estimated` of all records.

    A declared noise is the sensor's; the quantisation of the record, a variance of step^2 / 12, is added to it. Of a channel that was
    filtered both, and an estimate, are those before the filter times its gain for white noise.
    A channel that stands still, or has too few samples, has no estimate of its own: it takes the largest one of the same channel in another
    record, else of a channel of the same dimension. Fitted records take none from records that are held back. Notices say what was
    estimated.

    Raises:
        ExperimentError: a channel's noise is not declared and can neither be estimated nor taken from another record; where it is not
            `needed`, the channel is left out of `noise`.
    """
    estimates = [
        {channel: _sensed(record, channel)[0] for channel in record.channels if sensors[channel].noise is None} for record in records
    ]
    of_fitted = [own for record, own in zip(records, estimates, strict=True) if not record.held_back]
    filled = []
    for record, own in zip(records, estimates, strict=True):
        noise, notices = {}, []
        for channel in record.channels:
            found, said = _noise_of(record, channel, own, estimates if record.held_back else of_fitted, sensors)
            notices += [f"{channel}: {said}"] if said else []
            if found is not None:
                noise[channel] = found
            elif needed:
                raise ExperimentError(
                    f"{channel} stands still in record {shown(record.file)}, so its noise cannot be estimated: expected a declared noise; "
                    f"add 'noise = …' in {si_unit(channel)} to [sensors.{channel}], or remove that table"
                )
        white = [f"{channel} {std:.3g} {si_unit(channel)}" for channel, std in own.items() if std is not None]
        notices += [f"Noise not declared, estimated as if it were white: {', '.join(white)}."] if white else []
        known = frozenset(own.keys() & noise.keys())
        filled.append(replace(record, noise=noise, noise_estimated=known, notices=(*record.notices, *notices)))
    return tuple(filled)


def _noise_of(
    record: Record, channel: str, own: Estimates, others: Sequence[Estimates], sensors: dict[str, Sensor]
) -> tuple[float | None, str]:
    """Noise of a channel: declared, its own estimate, or taken from other records; and what is worth saying about it."""
    unit, declared, values = si_unit(channel), sensors[channel].noise, record.channels[channel]
    if declared is not None:
        step, gain = _sensed(record, channel)[1], record.sensed[channel].gain if channel in record.sensed else 1.0
        total = hypot(declared * gain, step / sqrt(12.0))
        if total <= 1.02 * declared * gain:  # not worth a word
            return total, ""
        return total, f"its steps of {step:.3g} {unit} raise the declared noise from {declared * gain:.3g} to {total:.3g} {unit}."
    if (estimate := own[channel]) is not None:
        if estimate >= 1e-7 * float(np.nanmax(values) - np.nanmin(values)):  # no measurement is quieter
            return estimate, ""
        return estimate, f"so little noise looks computed, not measured; declare 'noise' in [sensors.{channel}]."
    alike = [other for other in sensors if CHANNELS[other] == CHANNELS[channel] and other != channel]
    for candidate in (channel, *alike):
        found = [std for estimates in others if (std := estimates.get(candidate)) is not None]
        std = sensors[candidate].noise or max(found, default=None)
        if std is not None:
            source = "the other records" if candidate == channel else candidate
            return std, f"the noise cannot be estimated from this record; {std:.3g} {unit} taken from {source}."
    return None, ""


def _sensed(record: Record, channel: str) -> tuple[float | None, float]:
    """Estimated noise and quantisation of a channel; of one that was filtered, what is left of them behind the filter."""
    if channel not in record.sensed:
        values = record.channels[channel]
        return estimate_noise(values), quantisation_step(values)
    before = record.sensed[channel]
    return None if before.estimate is None else before.gain * before.estimate, before.gain * before.step
