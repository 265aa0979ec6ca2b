"""Which column of a file is which channel."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import CHANNELS, TIME
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.readers import Columns
from identification.experiment.sensor import Sensor
from identification.experiment.settings.record_settings import RecordSettings


@dataclass(frozen=True, kw_only=True, eq=False)
class RawRecord:
    """Columns under the names of channels, still in the units of the file.

    Attributes:
        time: time column, shape (samples,).
        channels: the recorded channels, shape (samples,) each.
        notices: sentences on channels that are missing and columns that are not used.
    """

    time: Float64[np.ndarray, " samples"]
    channels: dict[str, Float64[np.ndarray, " samples"]]
    notices: tuple[str, ...]


def wanted_columns(settings: RecordSettings, sensors: dict[str, Sensor]) -> dict[str, str]:
    """Say which column to look for, for time and for every sensor.

    Args:
        settings: of the record; its `columns` rename.
        sensors: of the experiment.

    Returns:
        Column name by channel name.

    Raises:
        ExperimentError: a channel with a column or unit of its own has no sensor, or two channels want one column.
    """
    for key, channels in (("columns", settings.columns), ("units", settings.units)):
        for channel in channels:
            if channel != TIME and channel not in sensors:
                raise ExperimentError(f"{key} of {settings.where} names {channel}: expected its table [sensors.{channel}]; add it")
    wanted = {channel: settings.columns.get(channel, channel) for channel in (TIME, *sensors)}
    for channel, name in wanted.items():
        if list(wanted.values()).count(name) > 1:
            raise ExperimentError(f"column {shown(name)} of {settings.where} serves {channel} and another channel: expected one; rename it")
    return wanted


def assign(columns: Columns, wanted: dict[str, str], settings: RecordSettings, need_channels: bool) -> RawRecord:
    """Put the file's columns under the names of channels.

    Args:
        columns: as read.
        wanted: from `wanted_columns`.
        settings: of the record.
        need_channels: whether at least one channel beside time must be there.

    Returns:
        Time and channels.

    Raises:
        ExperimentError: no time, no channel, a column that was named is not there, or the lengths differ.
    """
    values = dict(columns.values)
    rate, notices = settings.numbers["sampling_frequency"], []
    if rate is not None and wanted[TIME] not in columns.names and TIME not in settings.columns and values:
        values[wanted[TIME]] = np.arange(max(column.size for column in values.values())) / rate
        notices.append(f"The file has no time stamps; they follow from the declared sampling_frequency of {rate:.6g} Hz.")
    for channel in (TIME, *settings.columns):
        if wanted[channel] not in values:
            raise ExperimentError(
                f"{settings.where} has no column {shown(wanted[channel])} for {channel}: expected it among {listed(columns.names)}; "
                "name the right one in 'columns' of the record"
                + (", or give its sampling_frequency there where the file has no time stamps" if channel == TIME else "")
            )
    time = values[wanted[TIME]]
    channels = {channel: values[name] for channel, name in wanted.items() if channel != TIME and name in values}
    if need_channels and wanted.keys() == {TIME}:
        raise ExperimentError(
            f"no channel is declared for {settings.where}, which has {listed(columns.names)}: expected a table [sensors.CHANNEL] with its "
            f"unit for each that was recorded, CHANNEL being one of {listed(CHANNELS)}; add them"
        )
    if need_channels and not channels:
        raise ExperimentError(
            f"{settings.where} has no recorded channel, only {listed(columns.names)}: expected at least one of "
            f"{listed(name for channel, name in wanted.items() if channel != TIME)}; add its column or name it in 'columns'"
        )
    for channel, column in channels.items():
        if column.size != time.size:
            raise ExperimentError(
                f"{settings.where} has {time.size} time stamps and {column.size} samples of {channel}: expected equally many; export again"
            )
    return RawRecord(time=time, channels=channels, notices=(*notices, *_notices(columns, wanted, channels)))


def _notices(columns: Columns, wanted: dict[str, str], channels: dict[str, Float64[np.ndarray, " samples"]]) -> tuple[str, ...]:
    """Notices on missing channels and on columns that are not used."""
    notices = [f"{channel} is not recorded here." for channel in wanted if channel != TIME and channel not in channels]
    rest = [name for name in columns.names if name not in wanted.values()]
    unset = [name for name in rest if name in CHANNELS]
    if unset:
        notices.append(f"Columns without a table in [sensors] are not used: {listed(unset)}.")
    if len(rest) > len(unset):
        notices.append(f"Columns that are no channel are not used: {listed(name for name in rest if name not in CHANNELS)}.")
    return tuple(notices)
