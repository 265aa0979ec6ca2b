"""Recorders' own formats: the libraries behind them, and channels, each with its own time axis, as columns on one time axis."""

import importlib
import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from jaxtyping import Float64, Shaped

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.limits import check_claim, check_samples
from identification.experiment.readers.base import Columns, as_column

INSTALL = 'pip install "vibrojax[labdata]"'


def load_library(name: str, kind: str) -> ModuleType:
    """Import the library that reads a format, `kind` for the message.

    Example:
        >>> load_library("no_such_library", "TDMS")
        Traceback (most recent call last):
        identification.experiment.errors.ExperimentError: TDMS files need the package no_such_library, which is not installed: \
run pip install "vibrojax[labdata]", or export the record to .csv, .h5, .mat or .npz
    """
    try:
        with silenced(name):
            return importlib.import_module(name)
    except ImportError as error:
        raise ExperimentError(
            f"{kind} files need the package {name}, which is not installed: run {INSTALL}, or export the record to .csv, .h5, .mat or .npz"
        ) from error


@contextmanager
def silenced(name: str) -> Iterator[None]:
    """A block in which a library logs nothing, nor reports errors while its half-made objects are thrown away.

    What is wrong with a file is said once, by the reader.
    """
    logger, hook = logging.getLogger(name), sys.unraisablehook
    before = logger.disabled, logger.level, [(child, child.disabled) for child in _children(name)]
    try:
        sys.unraisablehook = lambda unraisable: None
        logger.disabled = True
        for child, _ in before[2]:
            child.disabled = True
        yield
    finally:
        sys.unraisablehook = hook
        logger.disabled = before[0]
        for child, disabled in before[2]:
            child.disabled = disabled


def _children(name: str) -> list[logging.Logger]:
    """The loggers of a library's modules."""
    loggers = list(logging.Logger.manager.loggerDict.items())
    return [one for key, one in loggers if key.startswith(f"{name}.") and isinstance(one, logging.Logger)]


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
    """Name channels as briefly as can be: by their own name where no other channel of the file bears it, else in full, with the group.

    Example:
        >>> unique_names(["x", "F", "x"], ["fast/x", "fast/F", "slow/x"])
        ['fast/x', 'F', 'slow/x']
    """
    return [name if name and list(names).count(name) == 1 else full for name, full in zip(names, full_names, strict=True)]


def to_columns(channels: Sequence[RecorderChannel], wanted: AbstractSet[str], stored_bytes: int) -> Columns:
    """Read the wanted channels and their common time axis, which becomes the column "time" where no channel bears that name.

    Refused are a file without channels or with too many samples for its size, and wanted channels on different time axes or without one.
    """
    if not channels:
        raise ExperimentError("the file holds no channel: expected at least one with samples; export the record again")
    chosen = [channel for channel in channels if channel.name in wanted]
    for channel in chosen:
        check_samples(channel.samples, f"channel {shown(channel.name)}")
    check_claim(8 * sum(channel.samples for channel in chosen), stored_bytes)
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
    for other in channels[1:]:
        another = _time_of(other)
        if other.time_unit != first.time_unit or not same_axis(time, another):
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


def same_axis(time: Float64[np.ndarray, " _"], other: Float64[np.ndarray, " _"]) -> bool:
    """Whether two time axes are one, but for rounding and for stamps that one of them lacks (NaN).

    Example:
        >>> same_axis(np.array([0.0, 0.5, 1.0]), np.array([0.0, np.nan, 1.001])), same_axis(np.array([0.0, 0.5]), np.array([0.0, 0.6]))
        (True, False)
    """
    if time.size != other.size:
        return False
    steps = np.diff(time[np.isfinite(time)])
    apart = np.abs(other - time)
    return bool(apart[np.isfinite(apart)].max(initial=0.0) <= TOLERANCE * abs(float(np.median(steps)) if steps.size else 0.0))


def axis(time: Float64[np.ndarray, " samples"]) -> str:
    """A time axis in a message: its number of samples, first stamp and step.

    Example:
        >>> axis(np.array([0.0, 0.5, 1.0]))
        '3 samples from 0 at steps of 0.5'
    """
    if time.size < 2:
        return listed([f"{time.size} samples"])
    return f"{time.size} samples from {time[0]:.6g} at steps of {float(np.median(np.diff(time))):.6g}"
