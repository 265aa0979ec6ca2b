"""Recorders' own formats, TDMS, universal files and MDF 4: the libraries behind them, and channels as columns on one time axis."""

import importlib
from collections.abc import Callable, Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from jaxtyping import Float64, Shaped

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import MAX_TEXT_BYTES, check_claim, check_numeric, check_samples
from identification.experiment.readers.base import AbstractReader, Columns, as_column


def load_library(name: str, kind: str) -> ModuleType:
    """Import the library that reads a format, `kind` for the message.

    Example:
        >>> load_library("no_such_library", "TDMS")
        Traceback (most recent call last):
        identification.experiment.errors.ExperimentError: TDMS files need the package no_such_library, which is not installed: \
run pip install "vibrojax[labdata]", or export the record to .csv, .h5, .mat or .npz
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ExperimentError(
            f'{kind} files need the package {name}, which is not installed: run pip install "vibrojax[labdata]", or export the record to '
            ".csv, .h5, .mat or .npz"
        ) from error


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
            values[TIME], unit = common_axis((channel.name, _time_of(channel)) for channel in chosen), chosen[0].time_unit
            if other := next((channel for channel in chosen if channel.time_unit != unit), None):
                raise ExperimentError(
                    f"the times of channels {shown(chosen[0].name)} and {shown(other.name)} are in {shown(unit)} and "
                    f"{shown(other.time_unit)}: expected one unit for all channels of a record; export them so"
                )
            units |= {TIME: unit.strip()} if stated(unit) else {}
    return Columns(names=tuple(names), values=values, units=units)


def stated(unit: str) -> bool:
    """Say whether a unit's text names one; formats fill an empty place with a word for nothing."""
    return unit.strip().lower() not in ("", "none", "-", "1")


def _time_of(channel: RecorderChannel) -> Float64[np.ndarray, " samples"]:
    """The time axis of one channel."""
    if channel.time is None:
        raise ExperimentError(
            f"channel {shown(channel.name)} has no time axis: expected the sampling step in the file, or a channel with time stamps; "
            f"name it in 'columns' of the record ({TIME} = ...)"
        )
    return as_column(channel.time(), TIME)


def common_axis(axes: Iterable[tuple[str, Float64[np.ndarray, " _"]]]) -> Float64[np.ndarray, " samples"]:
    """The one time axis of channels, each given by name with its own; where one lacks a stamp (NaN), that of another counts."""
    every = iter(axes)
    first, stamps = next(every)
    time = stamps
    for other, another in every:
        if not same_axis(stamps, another):
            raise ExperimentError(
                f"channels {shown(first)} ({axis(stamps)}) and {shown(other)} ({axis(another)}) are sampled differently: "
                "expected one time axis for all channels of a record; resample them to one rate and export again"
            )
        time = np.where(np.isfinite(time), time, another)
    return time


def same_axis(time: Float64[np.ndarray, " _"], other: Float64[np.ndarray, " _"]) -> bool:
    """Whether two time axes are one, but for a hundredth of a step and for stamps that one of them lacks (NaN).

    Example:
        >>> same_axis(np.array([0.0, 0.5, 1.0]), np.array([0.0, np.nan, 1.001])), same_axis(np.array([0.0, 0.5]), np.array([0.0, 0.6]))
        (True, False)
    """
    if time.size != other.size:
        return False
    steps = np.diff(time[np.isfinite(time)])
    apart = np.abs(other - time)
    return bool(apart[np.isfinite(apart)].max(initial=0.0) <= 0.01 * abs(float(np.median(steps)) if steps.size else 0.0))


def axis(time: Float64[np.ndarray, " samples"]) -> str:
    """The filled part of a time axis in a message: its number of samples, first stamp and step.

    Example:
        >>> axis(np.array([0.0, 0.5, 1.0]))
        '3 samples from 0 at steps of 0.5'
    """
    time = time[np.isfinite(time)]
    if time.size < 2:
        return f"{time.size} samples"
    return f"{time.size} samples from {time[0]:.6g} at steps of {float(np.median(np.diff(time))):.6g}"


class TdmsReader(AbstractReader):
    """Reads channels by name, or as "group/channel" where a name is there twice.

    Unit: property `unit_string`. Time: properties `wf_start_offset` and `wf_increment`, in s, and `wf_start_time` where channels begin at
    different times; or a channel of numbers or absolute time stamps, the first of which becomes 0.
    """

    suffixes = (".tdms",)
    format = "TDMS"
    apart = True
    library = "nptdms"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        library = load_library(self.library, self.format)
        with path.open("rb") as stream, library.TdmsFile.open(stream) as file:
            if file.file_status.incomplete_final_segment:
                raise ExperimentError("the file breaks off in its last segment: expected a complete file; copy it again, or save it again")
            stored = [(group.name, channel) for group in file.groups() for channel in group.channels()]
            full = [f"{group}/{channel.name}" for group, channel in stored]
            names = unique_names([channel.name for _, channel in stored], full)
            named = [(channel, name) for (_, channel), name in zip(stored, names, strict=True)]
            begins = [one.properties.get("wf_start_time") for one, name in named if name in wanted and name != TIME]
            start = min((begin for begin in begins if begin is not None), default=None)
            channels = [_tdms_channel(channel, name, start) for channel, name in named]
            return to_columns(channels, wanted, path.stat().st_size)


def _tdms_channel(channel: Any, name: str, start: np.datetime64 | None) -> RecorderChannel:
    """Describe a channel of the library."""
    properties, samples = channel.properties, len(channel)
    step = properties.get("wf_increment")

    def read() -> np.ndarray:
        if np.issubdtype(channel.dtype, np.datetime64):
            stamps = channel[:]
            return (stamps - stamps[0]) / np.timedelta64(1, "s") if samples else np.empty(0)
        check_numeric(np.dtype(channel.dtype), name)
        return np.asarray(channel[:])

    def time() -> np.ndarray:
        if not isinstance(step, int | float) or not step > 0:
            raise ExperimentError(f"wf_increment of channel {shown(name)} is {shown(step)}: expected a time step above 0 in s; correct it")
        began = properties.get("wf_start_time")
        late = (began - start) / np.timedelta64(1, "s") if start is not None and began is not None else 0.0
        return float(late) + float(properties.get("wf_start_offset", 0.0)) + float(step) * np.arange(samples)

    unit = str(properties.get("unit_string", ""))
    return RecorderChannel(name=name, unit=unit, samples=samples, read=read, time=None if step is None else time)


DIRECTIONS = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z", 4: "+RX", -4: "-RX", 5: "+RY", -5: "-RY", 6: "+RZ", -6: "-RZ"}


class UffReader(AbstractReader):
    """Reads time responses.

    A channel bears the first ID line, or its node and direction ("12+Z") where ID lines are empty or repeat, or "dataset 3". Unit: the
    label of the ordinate's units. Time: the abscissa, evenly or unevenly spaced, in the unit of its label.
    """

    suffixes = (".unv", ".uff")
    format = "universal file"
    apart = True
    library = "pyuff"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        library = load_library(self.library, "universal (.unv, .uff)")
        _check_end(path)
        file = library.UFF(str(path))
        places = [place for place, kind in enumerate(file.get_set_types()) if kind == 58]  # functions of time or frequency
        heads = [file.read_sets(place, header_only=True) for place in places]
        by_text = [str(head["id1"]).strip() for head in heads]
        by_place = [f"{head['rsp_node']}{DIRECTIONS.get(head['rsp_dir'], '')}" for head in heads]
        unique = (names for names in (by_text, by_place) if all(map(stated, names)) and len(set(names)) == len(names))
        names = next(unique, [f"dataset {number}" for number in range(1, len(heads) + 1)])
        channels = [_uff_channel(file, place, head, name) for place, head, name in zip(places, heads, names, strict=True)]
        return to_columns(channels, wanted, path.stat().st_size)


def _check_end(path: Path) -> None:
    """Every data set ends with a line "-1"; a file that was cut off does not."""
    size = path.stat().st_size
    if size > MAX_TEXT_BYTES:
        raise ExperimentError(f"the file has {size} bytes: expected at most {MAX_TEXT_BYTES}; cut or decimate the record")
    with path.open("rb") as stream:
        stream.seek(max(0, size - 200))
        tail = stream.read()
    if not tail.rstrip().endswith(b"    -1"):
        raise ExperimentError("the file does not end with a line '    -1': expected a complete universal file; copy or export it again")


def _uff_channel(file: Any, place: int, head: dict[str, Any], name: str) -> RecorderChannel:
    """Describe a data set; it is read once, when either its samples or its time stamps are asked for."""
    data: dict[str, np.ndarray] = {}

    def loaded(key: str) -> np.ndarray:
        if not data:
            if head["func_type"] not in (0, 1) or head["abscissa_spec_data_type"] not in (0, 1, 17):  # 0: unknown; 1 of an axis: general
                raise ExperimentError(
                    f"data set {shown(name)} is of function type {head['func_type']} over an abscissa of type "
                    f"{head['abscissa_spec_data_type']}: expected a time response (1) over time (17); export the time histories"
                )
            whole = file.read_sets(place)
            if len(whole["data"]) != head["num_pts"]:
                raise ExperimentError(
                    f"data set {shown(name)} holds {len(whole['data'])} samples and announces {head['num_pts']}: "
                    "the file is damaged, export it again"
                )
            data.update(x=whole["x"], data=whole["data"])
        return data[key]

    return RecorderChannel(
        name=name,
        unit=str(head["ordinate_axis_units_lab"]),
        samples=int(head["num_pts"]),
        read=lambda: loaded("data"),
        time=lambda: loaded("x"),
        time_unit=str(head["abscissa_axis_units_lab"]),
    )


class Mdf4Reader(AbstractReader):
    """Reads channels by name, or as "group/channel" where a name is there twice; a group without name bears its number, from 1.

    Unit: that of the channel, or of its conversion. Time: the master channel of the group. A sample that the file marks as invalid is NaN.
    """

    suffixes = (".mf4",)
    format = "MDF 4"
    apart = True
    library = "asammdf"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        library = load_library(self.library, self.format)
        with path.open("rb") as stream:
            begin = stream.read(12)
            stream.seek(0)
            if begin.startswith(b"UnFinMF"):
                raise ExperimentError(
                    "the recorder did not finish the file: expected a finalised MDF 4 file; save it again with the recorder's program"
                )
            if not begin.startswith(b"MDF") or begin[8:9] != b"4":
                raise ExperimentError(f"the file begins with {shown(begin)}: expected an MDF file of version 4; export it as MDF 4")
            try:
                opened = library.MDF(stream)
            except Exception as error:
                reason = str(error) or type(error).__name__
                raise ExperimentError(
                    f"its blocks do not fit together ({reason[:120]}): the file is cut off or damaged, copy or export it again"
                ) from error
            with opened as file:
                return to_columns(_mdf4_channels(file), wanted, path.stat().st_size)


def _mdf4_channels(file: Any) -> list[RecorderChannel]:
    """Describe every channel but the masters."""
    stored = []
    for group, described in enumerate(file.groups):
        master = file.masters_db.get(group)
        stored += [(group, index, channel) for index, channel in enumerate(described.channels) if index != master]
    own = [str(channel.name) for _, _, channel in stored]
    full = [f"{file.groups[group].channel_group.acq_name or group + 1}/{channel.name}" for group, _, channel in stored]
    if len(set(full)) < len(full):
        full = [f"{group + 1}/{index}/{channel.name}" for group, index, channel in stored]
    names = unique_names(own, full)
    return [_mdf4_channel(file, group, index, channel, name) for (group, index, channel), name in zip(stored, names, strict=True)]


def _mdf4_channel(file: Any, group: int, index: int, channel: Any, name: str) -> RecorderChannel:
    """Describe one channel; it is read once, when either its samples or its time stamps are asked for."""
    loaded: list[Any] = []
    master = file.masters_db.get(group)
    axis = None if master is None else file.groups[group].channels[master]

    def signal() -> Any:
        if not loaded:
            loaded.append(file.get(group=group, index=index, ignore_invalidation_bits=True))  # else such samples are dropped
        return loaded[0]

    def read() -> np.ndarray:
        _check_conversion(channel, name)
        samples = np.asarray(signal().samples)
        check_numeric(samples.dtype, name)
        invalid = signal().invalidation_bits
        return samples if invalid is None else np.where(np.asarray(invalid, dtype=bool), np.nan, samples.astype(np.float64))

    def time() -> np.ndarray:
        if axis is not None and axis.sync_type != 1:  # a master of time
            raise ExperimentError(f"channel {shown(name)} is recorded over {shown(axis.name)}, which is no time: expected {TIME} in s")
        if axis is not None:
            _check_conversion(axis, str(axis.name))
        return np.asarray(signal().timestamps)

    conversion = channel.conversion
    unit = channel.unit or (conversion.unit if conversion is not None else "")
    cycles = int(file.groups[group].channel_group.cycles_nr)
    time_unit = "s" if axis is None else str(axis.unit or "s")
    return RecorderChannel(
        name=name, unit=str(unit or ""), samples=cycles, read=read, time=None if axis is None else time, time_unit=time_unit
    )


def _check_conversion(channel: Any, name: str) -> None:
    """Refuse a formula, which the library would evaluate as written, and whatever else gives no number by a fixed rule."""
    conversion = channel.conversion
    kind = 0 if conversion is None else int(conversion.conversion_type)
    if conversion is not None and kind == 3:
        raise ExperimentError(
            f"channel {shown(name)} is converted by the formula {shown(conversion.formula)}, which is not evaluated: expected a "
            "linear or rational conversion, or a table of numbers; export physical values"
        )
    if kind not in (0, 1, 2, 4, 5, 6):  # none, linear, rational, three kinds of table
        raise ExperimentError(f"channel {shown(name)} is converted to text or bits (type {kind}): expected numbers; export the raw values")
