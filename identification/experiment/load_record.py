"""From one `[[record]]` table to a record: columns become channels, their numbers SI."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import (
    CART_CHANNELS,
    CHANNELS,
    MOTION_CHANNELS,
    TIME,
    Angle,
    example,
    factor_to_si,
    output_of,
    read_angle,
    same_unit,
    si_unit,
    unit_in_name,
)
from identification.experiment.checks import check_saturation
from identification.experiment.clock import check_drive, check_time, chosen_stretch, clocked, declared_time, drop_bad_time, rebuilt
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.experiment import Record, Sensed, Sensor
from identification.experiment.limits import file_exists, record_path, sha256_of
from identification.experiment.readers import Columns, read_columns, without
from identification.experiment.samples import cropped, mark_missing, mask_range, prepared
from identification.experiment.settings import RecordSettings


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
    """Name of the column to look for, by channel: that of `columns` of the record, else the channel's own; for time and every sensor.

    Refused are a channel with a column or unit of its own and no sensor, and two channels that want one column.
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


def angle_of(across: Float64[np.ndarray, " samples"], along: Float64[np.ndarray, " samples"]) -> Float64[np.ndarray, " samples"]:
    """Angle, rad, of a point seen from a pivot at the origin, from its coordinates across and along where the angle is zero.

    Without jumps by a whole turn; NaN where a coordinate is.
    """
    angle = np.arctan2(across, along)
    usable = np.isfinite(angle)
    angle[usable] = np.unwrap(angle[usable])
    return angle


def with_angles(columns: Columns, angles: dict[str, Angle], where: str) -> Columns:
    """The columns of a file, with angles, rad, in place of those that they are made of; without jumps by a whole turn."""
    for name, angle in angles.items():
        for part in (angle.across, angle.along):
            if part not in columns.names or part not in columns.values:
                raise ExperimentError(
                    f"{where} has no column {shown(part)} for {name}: expected it among {listed(columns.names)}; name the right one"
                )
        across, along = (sign * columns.values[part] for sign, part in zip(angle.signs, (angle.across, angle.along), strict=True))
        if across.size != along.size:
            raise ExperimentError(
                f"{where} has {across.size} samples of {angle.across} and {along.size} of {angle.along}: expected one number; export again"
            )
        names = tuple(one for one in columns.names if one not in (angle.across, angle.along))
        columns = replace(
            columns, names=(*names, name), values=columns.values | {name: angle_of(across, along)}, units=columns.units | {name: "rad"}
        )
    return columns


def assign(columns: Columns, wanted: dict[str, str], settings: RecordSettings, need_channels: bool) -> RawRecord:
    """Put the file's columns under the names of channels; with `need_channels` at least one beside time must be there.

    Refused are a file without time, or without a column that was named, and channels whose lengths differ.
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


def stated_unit(dimension: str, declared: str | None, column: str, units: Mapping[str, str]) -> tuple[str | None, tuple[str, ...]]:
    """The unit that a file states for a column of a dimension, None where it is silent; and a sentence, if there is a contradiction.

    Brackets behind the column's name count as its statement. Where the experiment file contradicts them by a factor only, it counts, since
    names are often copied from another table.

    Example:
        >>> stated_unit("displacement", "m", "Laser [mm]", {})[0], stated_unit("displacement", None, "Laser [mm]", {})[0]
        (None, 'mm')
    """
    if column in units:
        return units[column], ()
    named = unit_in_name(column, dimension)
    if named is None or declared is None or output_of(named) != output_of(declared):
        return named, ()
    if same_unit(named, declared, output_of(named) or dimension):
        return named, ()
    return None, (f"The name of column {shown(column)} says {named}, the experiment file {declared}, which counts.",)


def channel_factor(channel: str, sensor: Sensor, settings: RecordSettings, stated: str | None) -> float:
    """SI value of one unit of the recorded numbers of a channel.

    `units` of the record overrules everything, for a file whose own statement is wrong, or whose numbers are no sensor's output. Else the
    unit that the file states and that of the sensor's table must agree, and one of them must be there. A sensor with a sensitivity has
    units of its output, by default that of its sensitivity.
    """
    dimension, table = CHANNELS[channel], f"[sensors.{channel}]"

    def factor(unit: str, where: str) -> float:
        return factor_to_si(unit, dimension, where) if sensor.sensitivity is None else sensor.sensitivity.factor(unit, where)

    if channel in settings.units:
        unit, where = settings.units[channel], f"units of {settings.where}"
        return factor(unit, where) if output_of(unit) else factor_to_si(unit, dimension, where)
    if sensor.sensitivity is not None and stated is None:
        return factor(sensor.unit or sensor.sensitivity.unit, table)
    measured = sensor.unit or (si_unit(channel) if sensor.sensitivity is None else stated)
    overrule = f'units = {{ {channel} = "{measured}" }} in the record overrules the file'
    if stated is None and sensor.unit is None:
        raise ExperimentError(
            f"unit is missing in {table}, and the file of {settings.where} states none: expected one of {dimension}; "
            f"add a line 'unit = \"{si_unit(channel)}\"'"
        )
    if stated is not None and sensor.unit is None and sensor.sensitivity is None and output_of(stated):
        itself = ", or 'unit = \"V\"' where the volt stands for the quantity itself" if same_unit(stated, "V", dimension) else ""
        raise ExperimentError(
            f"{settings.where} states {channel} in {shown(stated)}: expected the sensitivity of the sensor; add a line "
            f"'sensitivity = \"{example(dimension, stated)}\"' to {table}{itself}"
        )
    if stated is not None and sensor.unit is None:
        try:
            return factor(stated, f"the file of {settings.where} for {channel}")
        except ExperimentError as error:
            raise ExperimentError(f"{error}; {overrule}") from error
    if stated is not None and sensor.unit is not None and not same_unit(stated, sensor.unit, output_of(sensor.unit) or dimension):
        through = ", or give the sensitivity of the sensor there" if output_of(stated) and sensor.sensitivity is None else ""
        raise ExperimentError(
            f"{settings.where} states {channel} in {shown(stated)} and {table} in {shown(sensor.unit)}: expected one unit; "
            f"correct or remove that of {table}{through}, or {overrule}"
        )
    return factor(sensor.unit or "", table)


def time_factor(settings: RecordSettings, stated: str | None) -> float:
    """Seconds in one unit of the recorded time stamps: of `time_unit` of the record, else of what the file states, else s."""
    if settings.clock.unit is not None or stated is None:
        return factor_to_si(settings.clock.unit or "s", TIME, settings.where)
    try:
        return factor_to_si(stated, TIME, f"the file of {settings.where} for its time")
    except ExperimentError as error:
        raise ExperimentError(f"{error}; time_unit in the record overrules the file") from error


ANSWERS = ("reaction_force", "impact_force", "hammer_acceleration")
"""What a hammer on a prescribed path is compared by: `hammer_acceleration` is then all force on it over its mass."""


def load_record(settings: RecordSettings, folder: Path, sensors: dict[str, Sensor], *, need_file: bool) -> Record:
    """Load one record, without its noise, which is filled in later, when all records are there.

    Args:
        settings: the checked table.
        folder: the experiment's folder.
        sensors: of the experiment.
        need_file: False lets a record go without its file or its channels, if its time stamps are known.

    Raises:
        ExperimentError: the file is missing, damaged or not as it should be, or lacks a channel that the record's kind needs.
    """
    path = record_path(folder, settings.file)
    wanted = wanted_columns(settings, sensors)
    if not file_exists(path, settings.file):
        return _without_file(settings, need_file)
    angles = {name: angle for name in wanted.values() if (angle := read_angle(name)) is not None}
    parts = {name for angle in angles.values() for name in (angle.across, angle.along)}
    columns = read_columns(path, frozenset(wanted.values()) | parts, settings.file)
    measured = [name for name in columns.values if name != wanted[TIME]]  # a stamp may have the value of a mark
    declared = [one for name in measured for one in without(columns, name, settings.missing, "is {}, which the record declares missing,")]
    columns = with_angles(replace(columns, lost=(*columns.lost, *declared)), angles, settings.where)
    raw = assign(columns, wanted, settings, need_channels=need_file)
    time, recorded, said = _timed(raw, settings, wanted[TIME], columns)
    notices = [*columns.notices, *raw.notices, *said]
    _check_initial_state(settings, float(time[0]))
    channels = {}
    for channel, values in recorded.items():
        declared = settings.units.get(channel, sensors[channel].unit)
        stated, odd = stated_unit(CHANNELS[channel], declared, wanted[channel], columns.units)
        factor = channel_factor(channel, sensors[channel], settings, stated)
        notices.extend(odd)
        cleaned, found = _cleaned(values * (factor * sensors[channel].sign), time, channel, sensors[channel])
        notices.extend(found)
        if cleaned is not None:
            channels[channel] = cleaned
    sensed: dict[str, Sensed] = {}
    if settings.preparation.words and channels:
        time, channels, sensed, done = prepared(time, channels, settings.preparation, settings.where)
        notices.extend(done)
    if need_file:
        check_drive(settings.numbers["excitation_frequency"], time, settings.where)
    if need_file and not channels:
        raise ExperimentError(f"{settings.where} has no usable sample in any channel: expected some; record it again or remove it")
    _check_driving_channels(settings, set(channels))
    return Record(
        **_declared(settings),
        time=time,
        channels=channels,
        preparation=settings.preparation,
        sensed=sensed,
        sha256=sha256_of(path),
        notices=tuple(notices),
    )


def _timed(
    raw: RawRecord, settings: RecordSettings, name: str, columns: Columns
) -> tuple[Float64[np.ndarray, " kept"], dict[str, Float64[np.ndarray, " kept"]], tuple[str, ...]]:
    """Time, s, and channels by the clock of a record, whose column of time has a name; and notices."""
    clock = settings.clock
    stated, notices = stated_unit(TIME, clock.unit, name, columns.units)
    time, channels = raw.time * time_factor(settings, stated), raw.channels
    lost = tuple(one.sentence(time) for one in columns.lost)
    if clock.stretch is not None:
        part, said = chosen_stretch(time, clock.stretch, settings.where)
        time, channels, lost = time[part], {channel: values[part] for channel, values in channels.items()}, (*lost, said)
    if clock.rebuild:
        time, said = rebuilt(time, settings.numbers["sampling_frequency"], settings.where)
        lost = (*lost, said)
    else:
        time, evened = clocked(time, channels.values())
        lost = (*lost, *evened)
    time, channels, dropped = drop_bad_time(time, channels) if clock.drop_bad else (time, channels, ())
    odd = check_time(cropped(time, {}, settings.preparation, settings.where)[0], settings.where)
    return time, channels, (*notices, *lost, *dropped, *odd)


def _check_initial_state(settings: RecordSettings, begin: float) -> None:
    """An initial state is that of the first sample, s, of the file."""
    crop = settings.preparation.crop
    for name in ("initial_displacement", "initial_velocity"):
        if crop is not None and crop[0] > begin and settings.numbers[name] is not None:
            raise ExperimentError(
                f"{name} in {settings.where} is given beside a crop that begins at {crop[0]:g} s, {crop[0] - begin:g} s after the file: "
                f"expected none, after the crop the stated initial state no longer holds; remove {name}, or begin the crop with the file"
            )


def _declared(settings: RecordSettings) -> dict[str, Any]:
    """What the experiment file alone says of a record."""
    return {
        "file": settings.file,
        "kind": settings.kind,
        "gap": settings.gap,
        "base": settings.base,
        "held_back": settings.held_back,
        **settings.numbers,
    }


def _without_file(settings: RecordSettings, need_file: bool) -> Record:
    """Make a record from its declaration alone."""
    if need_file:
        raise ExperimentError(f"the file of {settings.where} is missing: expected it in the experiment's folder; put it there")
    _check_driving_channels(settings, set())
    time = declared_time(settings.numbers["duration"], settings.numbers["sampling_frequency"], settings.where)
    return Record(
        **_declared(settings),
        time=time,
        notices=("There is no file: the time stamps are those declared.",),
    )


def _cleaned(
    scaled: Float64[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"], channel: str, sensor: Sensor
) -> tuple[Float64[np.ndarray, " samples"] | None, tuple[str, ...]]:
    """Mark what is not usable in a channel, SI; None where nothing is."""
    marked, lost = mark_missing(scaled, time, channel)
    masked, beyond = mask_range(marked, time, channel, sensor)
    if not np.isfinite(masked).any():
        return None, (*beyond, f"{channel}: no sample is usable; the channel counts as not recorded.")
    return masked, (*lost, *beyond, *(found.sentence for found in check_saturation(time, masked, channel)))


def _check_driving_channels(settings: RecordSettings, channels: set[str]) -> None:
    """A record whose motion is driven by a recorded channel must hold that channel."""
    if settings.kind == "forced" and "applied_force" not in channels:
        raise ExperimentError(f"{settings.where} is 'forced' and has no applied_force: expected that channel; add column and sensor")
    if settings.kind == "prescribed":
        _check_prescribed(settings, channels)
    if settings.base == "measured" and not channels & set(CART_CHANNELS):
        raise ExperimentError(
            f"{settings.where} has base = 'measured' and no recorded cart motion: expected cart_displacement or cart_acceleration; "
            "add its column and its sensor"
        )


def _check_prescribed(settings: RecordSettings, channels: set[str]) -> None:
    """A prescribed motion must be recorded, and beside it something that the model can be compared with."""
    if not channels & set(MOTION_CHANNELS):
        raise ExperimentError(
            f"{settings.where} is 'prescribed' and its motion is not recorded: expected {MOTION_CHANNELS[0]} or {MOTION_CHANNELS[1]}; "
            "add its column and its sensor"
        )
    if not channels & set(ANSWERS):
        raise ExperimentError(
            f"{settings.where} is 'prescribed' and no force is recorded: expected one of {listed(ANSWERS)}; add its column and its sensor"
        )
