"""Samples that cannot be used, and the sentences that say so."""

import numpy as np
from jaxtyping import Bool, Float64, Int

from identification.experiment.channels import si_unit
from identification.experiment.readers.limits import LARGEST
from identification.experiment.sensor import Sensor

_ROUNDING = 1e-9
"""Of a limit: by so much a sample at it may fall short after units have been converted."""


def mark_missing(
    values: Float64[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"], channel: str
) -> tuple[Float64[np.ndarray, " samples"], tuple[str, ...]]:
    """Turn infinite samples into NaN, with a notice on all NaN samples.

    Args:
        values: one channel, SI, shape (samples,).
        time: s, shape (samples,).
        channel: its name.

    Returns:
        The channel with NaN for every unusable sample, and a notice if there are any.
    """
    lost = ~np.isfinite(values)
    if not lost.any():
        return values, ()
    why = f"(NaN, infinite, beyond {LARGEST:.0e} or empty)"
    notice = f"{channel}: {_samples(int(lost.sum()))} missing {why}, left out, in {_stretches(lost, time)}."
    return np.where(lost, np.nan, values), (notice,)


def mask_range(
    values: Float64[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"], channel: str, sensor: Sensor
) -> tuple[Float64[np.ndarray, " samples"], tuple[str, ...]]:
    """Turn samples at or beyond the declared range of the sensor into NaN.

    Args:
        values: one channel, SI, shape (samples,).
        time: s, shape (samples,).
        channel: its name.
        sensor: with the range, or without.

    Returns:
        The masked channel, and a notice if anything was masked.
    """
    if sensor.range is None:
        return values, ()
    low, high = sensor.range
    beyond = (values <= low + _ROUNDING * abs(low)) | (values >= high - _ROUNDING * abs(high))
    if not beyond.any():
        return values, ()
    notice = (
        f"{channel}: {_samples(int(beyond.sum()))} at or beyond the declared range, {low:.6g} to {high:.6g} {si_unit(channel)}: "
        f"left out, in {_stretches(beyond, time)}."
    )
    return np.where(beyond, np.nan, values), (notice,)


def runs_of(mask: Bool[np.ndarray, " samples"]) -> tuple[Int[np.ndarray, " stretches"], Int[np.ndarray, " stretches"]]:
    """Find the stretches in which a mask holds.

    Args:
        mask: shape (samples,).

    Returns:
        Index of the first sample of each stretch and index past its last, shape (stretches,) each.

    Example:
        >>> [edge.tolist() for edge in runs_of(np.array([False, True, True, False]))]
        [[1], [3]]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return edges[::2], edges[1::2]


def _samples(count: int) -> str:
    """Count in words."""
    return "1 sample is" if count == 1 else f"{count} samples are"


def _stretches(mask: Bool[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"]) -> str:
    """Place the stretches of a mask in time."""
    first, past = runs_of(mask)
    begin, end = time[first[0]], time[past[-1] - 1]
    if first.size == 1:
        return f"one stretch from {begin:.6g} s to {end:.6g} s ({end - begin:.4g} s long)"
    longest = int(np.argmax(past - first))
    return (
        f"{first.size} stretches between {begin:.6g} s and {end:.6g} s, the longest {past[longest] - first[longest]} samples "
        f"from {time[first[longest]]:.6g} s"
    )
