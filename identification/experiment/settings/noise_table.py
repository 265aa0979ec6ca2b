"""The noise of every channel of every record: declared, estimated, or taken from another record where neither is possible."""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, sqrt

import numpy as np

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.noise import estimate_noise, quantisation_step
from identification.experiment.record import Record
from identification.experiment.sensor import Sensor

# Below this share of the channel's span no measurement is that quiet.
COMPUTED = 1e-7
# A quantisation that raises the noise by more than this factor is reported.
REPORTED = 1.02


def with_noise(records: Sequence[Record], sensors: dict[str, Sensor], *, needed: bool = True) -> tuple[Record, ...]:
    """Fill in `noise` and `noise_estimated` of all records.

    A declared noise is the sensor's; the quantisation of the record, a variance of step^2 / 12, is added to it. Of a channel that was
    filtered both, and an estimate, are those before the filter times its gain for white noise.
    A channel that stands still, or has too few samples, has no estimate of its own: it takes the largest one of the same channel in another
    record, else of a channel of the same dimension. Fitted records take none from records that are held back.

    Args:
        records: with their channels.
        sensors: with the declared noise.
        needed: False leaves a channel out of `noise` where True would raise.

    Returns:
        The records with noise, and a notice on every estimate.

    Raises:
        ExperimentError: a channel's noise is not declared and can neither be estimated nor taken from another record.
    """
    estimates = [
        {channel: _sensed(record, channel)[0] for channel in record.channels if sensors[channel].noise is None} for record in records
    ]
    of_fitted = [own for record, own in zip(records, estimates, strict=True) if not record.held_back]
    filled = tuple(
        _filled(record, own, estimates if record.held_back else of_fitted, sensors) for record, own in zip(records, estimates, strict=True)
    )
    for record in filled:
        for channel in record.channels:
            if needed and channel not in record.noise:
                raise ExperimentError(
                    f"{channel} stands still in record {shown(record.file)}, so its noise cannot be estimated: expected a declared noise; "
                    f"add 'noise = …' in {si_unit(channel)} to [sensors.{channel}], or remove that table"
                )
    return filled


def _filled(record: Record, own: dict[str, float | None], estimates: list[dict[str, float | None]], sensors: dict[str, Sensor]) -> Record:
    """Fill in one record."""
    noise: dict[str, float] = {}
    estimated: list[str] = []
    notices = list(record.notices)
    for channel, values in record.channels.items():
        declared = sensors[channel].noise
        if declared is not None:
            step, declared = _sensed(record, channel)[1], declared * (record.sensed[channel].gain if channel in record.sensed else 1.0)
            noise[channel] = hypot(declared, step / sqrt(12.0))
            if noise[channel] > REPORTED * declared:
                notices.append(
                    f"{channel}: its steps of {step:.3g} {si_unit(channel)} raise the declared noise from {declared:.3g} to "
                    f"{noise[channel]:.3g} {si_unit(channel)}."
                )
            continue
        estimate = own[channel]
        if estimate is None:
            taken, source = _from_elsewhere(channel, estimates, sensors)
            if taken is not None:
                noise[channel] = taken
                notices.append(
                    f"{channel}: the noise cannot be estimated from this record; {taken:.3g} {si_unit(channel)} taken from {source}."
                )
            continue
        noise[channel] = estimate
        estimated.append(f"{channel} {estimate:.3g} {si_unit(channel)}")
        if estimate < COMPUTED * float(np.nanmax(values) - np.nanmin(values)):
            notices.append(f"{channel}: so little noise looks computed, not measured; declare 'noise' in [sensors.{channel}].")
    if estimated:
        notices.append(f"Noise not declared, estimated as if it were white: {', '.join(estimated)}.")
    return replace(record, noise=noise, noise_estimated=frozenset(channel for channel in own if channel in noise), notices=tuple(notices))


def _sensed(record: Record, channel: str) -> tuple[float | None, float]:
    """Estimated noise and quantisation of a channel; of one that was filtered, what is left of them behind the filter."""
    if channel not in record.sensed:
        values = record.channels[channel]
        return estimate_noise(values), quantisation_step(values)
    before = record.sensed[channel]
    return None if before.estimate is None else before.gain * before.estimate, before.gain * before.step


def _from_elsewhere(channel: str, estimates: list[dict[str, float | None]], sensors: dict[str, Sensor]) -> tuple[float | None, str]:
    """Find noise for a channel without an estimate, and where it comes from."""
    alike = [other for other in sensors if CHANNELS[other] == CHANNELS[channel] and other != channel]
    for candidate in (channel, *alike):
        found = [table[candidate] for table in estimates if table.get(candidate) is not None]
        declared = sensors[candidate].noise
        if found or declared is not None:
            value = declared if declared is not None else max(value for value in found if value is not None)
            return value, "the other records" if candidate == channel else candidate
    return None, ""
