"""MDF 4 files, the measurement data format of ASAM."""

import gc
from collections.abc import Set as AbstractSet
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_numeric
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.recorder import RecorderChannel, load_library, silenced, to_columns, unique_names

LIBRARY = "asammdf"
TIME_MASTER = 1
"""Synchronisation type of a master channel that counts time."""
CONVERSIONS = {0: "none", 1: "linear", 2: "rational", 4: "table", 5: "table", 6: "table of ranges"}
"""Types of conversion that give numbers by a fixed rule."""
FORMULA = 3


class Mdf4Reader(AbstractReader):
    """Reads channels by name, or as "group/channel" where a name is there twice; a group without name bears its number, from 1.

    Unit: that of the channel, or of its conversion. Time: the master channel of the group. A sample that the file marks as invalid is NaN.
    """

    suffixes = (".mf4",)
    format = "MDF 4"
    apart = True
    library = LIBRARY

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        library = load_library(LIBRARY, self.format)
        with path.open("rb") as stream, silenced(LIBRARY):
            _check_begin(stream)
            file = _opened(library, stream)
            with file:
                return to_columns(_channels(file), wanted, path.stat().st_size)


def _check_begin(stream: BufferedReader) -> None:
    """Refuse what is no MDF 4 file, or one that its recorder never closed."""
    begin = stream.read(12)
    stream.seek(0)
    if begin.startswith(b"UnFinMF"):
        raise ExperimentError(
            "the recorder did not finish the file: expected a finalised MDF 4 file; save it again with the recorder's program"
        )
    if not begin.startswith(b"MDF") or begin[8:9] != b"4":
        raise ExperimentError(f"the file begins with {shown(begin)}: expected an MDF file of version 4; export it as MDF 4")


def _opened(library: Any, stream: BufferedReader) -> Any:
    """Open the file; what the library leaves half made on failure is thrown away here, where its complaints are silenced."""
    try:
        return library.MDF(stream)
    except Exception as error:
        reason = str(error) or type(error).__name__
    gc.collect()  # the library's half-made object is part of a cycle, and complains when it goes
    raise ExperimentError(f"its blocks do not fit together ({reason[:120]}): the file is cut off or damaged, copy or export it again")


def _channels(file: Any) -> list[RecorderChannel]:
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
    return [_channel(file, group, index, channel, name) for (group, index, channel), name in zip(stored, names, strict=True)]


def _channel(file: Any, group: int, index: int, channel: Any, name: str) -> RecorderChannel:
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
        if axis is not None and axis.sync_type != TIME_MASTER:
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
    if conversion is None:
        return
    kind = int(conversion.conversion_type)
    if kind == FORMULA:
        raise ExperimentError(
            f"channel {shown(name)} is converted by the formula {shown(conversion.formula)}, which is not evaluated: expected a "
            "linear or rational conversion, or a table of numbers; export physical values"
        )
    if kind not in CONVERSIONS:
        raise ExperimentError(f"channel {shown(name)} is converted to text or bits (type {kind}): expected numbers; export the raw values")
