"""Channels of a recorder's file, each with its own time axis, as columns on one time axis."""

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Shaped

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.readers.base import Columns, as_column
from identification.experiment.readers.limits import check_claim, check_samples

TOLERANCE = 0.01
"""Of a sampling step: time axes that differ by less are one."""
NO_UNIT = ("", "none", "-", "1")


@dataclass(frozen=True, kw_only=True, eq=False)
class RecorderChannel:
    """One channel of a file.

    Attributes:
        name: unique in the file.
        unit: as the file states it, or empty.
        samples: number of them, known before they are read.
        read: gives the numbers.
        time: gives the channel's own time stamps; None where the file states no time for it.
        time_unit: of these stamps, as the file states it, or empty.
    """

    name: str
    unit: str
    samples: int
    read: Callable[[], Shaped[np.ndarray, "..."]]
    time: Callable[[], Shaped[np.ndarray, "..."]] | None
    time_unit: str = "s"


def unique_names(names: Sequence[str], full_names: Sequence[str]) -> list[str]:
    """Name channels as briefly as can be: by their own name where no other channel of the file bears it, else in full.

    Args:
        names: own names; may repeat or be empty.
        full_names: with the group, unique.

    Returns:
        The names.

    Example:
        >>> unique_names(["x", "F", "x"], ["fast/x", "fast/F", "slow/x"])
        ['fast/x', 'F', 'slow/x']
    """
    return [name if name and list(names).count(name) == 1 else full for name, full in zip(names, full_names, strict=True)]


def to_columns(channels: Sequence[RecorderChannel], wanted: AbstractSet[str], stored_bytes: int) -> Columns:
    """Read the wanted channels and their common time axis, which becomes the column "time" where no channel bears that name.

    Args:
        channels: all channels of the file.
        wanted: names of columns.
        stored_bytes: size of the file.

    Returns:
        Names of all columns, the wanted ones, and their units.

    Raises:
        ExperimentError: no channel at all, too many samples, wanted channels on different time axes, or without any time axis.
    """
    if not channels:
        raise ExperimentError("the file holds no channel: expected at least one with samples; export the record again")
    chosen = [channel for channel in channels if channel.name in wanted]
    for channel in chosen:
        check_samples(channel.samples, f"channel {shown(channel.name)}")
    check_claim(8 * sum(channel.samples for channel in chosen), stored_bytes, "the file")
    names = [channel.name for channel in channels]
    values = {channel.name: as_column(channel.read(), channel.name) for channel in chosen}
    units = {channel.name: channel.unit.strip() for channel in chosen if stated(channel.unit)}
    if TIME not in names:
        names.insert(0, TIME)
        if TIME in wanted and chosen:
            values[TIME], unit = _common_time(chosen)
            units |= {TIME: unit.strip()} if stated(unit) else {}
    return Columns(names=tuple(names), values=values, units=units)


def stated(unit: str) -> bool:
    """Say whether a unit's text names one; formats fill an empty place with a word for nothing."""
    return unit.strip().lower() not in NO_UNIT


def _common_time(channels: Sequence[RecorderChannel]) -> tuple[Float64[np.ndarray, " samples"], str]:
    """The time axis of all channels, and its unit."""
    first, time = channels[0], _time_of(channels[0])
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    for other in channels[1:]:
        another = _time_of(other)
        if another.size != time.size or other.time_unit != first.time_unit or np.abs(another - time).max(initial=0.0) > TOLERANCE * step:
            raise ExperimentError(
                f"channels {shown(first.name)} ({axis(time)}) and {shown(other.name)} ({axis(another)}) are sampled differently: "
                "expected one time axis for all channels of a record; resample them to one rate and export again"
            )
    return time, first.time_unit


def _time_of(channel: RecorderChannel) -> Float64[np.ndarray, " samples"]:
    """The time axis of one channel."""
    if channel.time is None:
        raise ExperimentError(
            f"channel {shown(channel.name)} has no time axis: expected the sampling step in the file, or a channel with time stamps; "
            f"name it in 'columns' of the record ({TIME} = ...)"
        )
    return as_column(channel.time(), TIME)


def axis(time: Float64[np.ndarray, " samples"]) -> str:
    """Describe a time axis in a message.

    Args:
        time: s, shape (samples,).

    Returns:
        Its number of samples, first stamp and step.

    Example:
        >>> axis(np.array([0.0, 0.5, 1.0]))
        '3 samples from 0 at steps of 0.5'
    """
    if time.size < 2:
        return listed([f"{time.size} samples"])
    return f"{time.size} samples from {time[0]:.6g} at steps of {float(np.median(np.diff(time))):.6g}"
