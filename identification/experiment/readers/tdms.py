"""TDMS files, as LabVIEW and other programs of National Instruments write them."""

from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_numeric
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.recorder import RecorderChannel, load_library, silenced, to_columns, unique_names

LIBRARY = "nptdms"


class TdmsReader(AbstractReader):
    """Reads channels by name, or as "group/channel" where a name is there twice.

    Unit: property `unit_string`. Time: properties `wf_start_offset` and `wf_increment`, in s, and `wf_start_time` where channels begin at
    different times; or a channel of numbers or absolute time stamps, the first of which becomes 0.
    """

    suffixes = (".tdms",)
    format = "TDMS"
    apart = True
    library = LIBRARY

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        library = load_library(LIBRARY, self.format)
        with path.open("rb") as stream, silenced(LIBRARY), library.TdmsFile.open(stream) as file:
            if file.file_status.incomplete_final_segment:
                raise ExperimentError("the file breaks off in its last segment: expected a complete file; copy it again, or save it again")
            stored = [(group.name, channel) for group in file.groups() for channel in group.channels()]
            full = [f"{group}/{channel.name}" for group, channel in stored]
            names = unique_names([channel.name for _, channel in stored], full)
            start = _earliest(channel for (_, channel), name in zip(stored, names, strict=True) if name in wanted and name != TIME)
            channels = [_channel(channel, name, start) for (_, channel), name in zip(stored, names, strict=True)]
            return to_columns(channels, wanted, path.stat().st_size)


def _channel(channel: Any, name: str, start: np.datetime64 | None) -> RecorderChannel:
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


def _earliest(channels: Any) -> np.datetime64 | None:
    """When the first of the channels began, where they say so."""
    begins = [channel.properties["wf_start_time"] for channel in channels if "wf_start_time" in channel.properties]
    return min(begins, default=None)
