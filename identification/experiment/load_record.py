"""From one `[[record]]` table to a record: columns become channels, their numbers SI."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import (
    CART_CHANNELS,
    CHANNELS,
    MOTION_CHANNELS,
    TIME,
    example,
    factor_to_si,
    output_of,
    same_unit,
    si_unit,
    unit_in_name,
)
from identification.experiment.checks import check_saturation
from identification.experiment.clock import check_drive_sampling, check_time, declared_time, timed
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.experiment import Preparation, Record, Sensed, Sensor
from identification.experiment.limits import file_exists, record_path, sha256_of
from identification.experiment.readers import Columns, read_columns, without
from identification.experiment.samples import cropped, mark_unusable, prepared
from identification.experiment.settings import RecordSettings

Samples = Float64[np.ndarray, " _"]


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


_ANGLE = re.compile(r"atan2\(\s*(-?)\s*([^,]+?)\s*,\s*(-?)\s*([^,]+?)\s*\)")
SignedColumn = tuple[int, str]


def read_angle(text: str) -> tuple[SignedColumn, SignedColumn] | None:
    """The two columns, each with its sign, of an angle that stands in place of a column's name (`angle_of`); None for any other text.

    Example:
        >>> read_angle("atan2(x, -y)"), read_angle("x")
        (((1, 'x'), (-1, 'y')), None)
    """
    if (found := _ANGLE.fullmatch(text.strip())) is None:
        return None
    minus_across, across, minus_along, along = found.groups()
    return (-1 if minus_across else 1, across), (-1 if minus_along else 1, along)


def with_angles(columns: Columns, angles: dict[str, tuple[SignedColumn, SignedColumn]], where: str) -> Columns:
    """The columns of a file, with angles, rad, in place of those that they are made of."""
    for name, parts in angles.items():
        used = [part for _, part in parts]
        for part in used:
            if part not in columns.names or part not in columns.values:
                raise ExperimentError(
                    f"{where} has no column {shown(part)} for {name}: expected it among {listed(columns.names)}; name the right one"
                )
        across, along = (sign * columns.values[part] for sign, part in parts)
        if across.size != along.size:
            raise ExperimentError(
                f"{where} has {across.size} samples of {used[0]} and {along.size} of {used[1]}: expected one number; export again"
            )
        values, units = columns.values | {name: angle_of(across, along)}, columns.units | {name: "rad"}
        columns = replace(columns, names=(*(one for one in columns.names if one not in used), name), values=values, units=units)
    return columns


def assign(
    columns: Columns, wanted: dict[str, str], settings: RecordSettings, need_channels: bool
) -> tuple[Samples, dict[str, Samples], tuple[str, ...]]:
    """Time and channels, in the units of the file, and notices on missing channels and columns that are not used.

    Refused are a file without time, or without a column that was named, channels whose lengths differ, and, with `need_channels`, a file
    without any channel beside time.
    """
    values = dict(columns.values)
    rate, notices = settings.record.sampling_frequency, []
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
    missing = [channel for channel in wanted if channel != TIME and channel not in channels]
    if need_channels and wanted.keys() == {TIME}:
        raise ExperimentError(
            f"no channel is declared for {settings.where}, which has {listed(columns.names)}: expected a table [sensors.CHANNEL] with its "
            f"unit for each that was recorded, CHANNEL being one of {listed(CHANNELS)}; add them"
        )
    if need_channels and not channels:
        raise ExperimentError(
            f"{settings.where} has no recorded channel, only {listed(columns.names)}: expected at least one of "
            f"{listed(missing)}; add its column or name it in 'columns'"
        )
    for channel, column in channels.items():
        if column.size != time.size:
            raise ExperimentError(
                f"{settings.where} has {time.size} time stamps and {column.size} samples of {channel}: expected equally many; export again"
            )
    notices += [f"{channel} is not recorded here." for channel in missing]
    rest = [name for name in columns.names if name not in wanted.values()]
    unset, others = [name for name in rest if name in CHANNELS], [name for name in rest if name not in CHANNELS]
    notices += [f"Columns without a table in [sensors] are not used: {listed(unset)}."] if unset else []
    notices += [f"Columns that are no channel are not used: {listed(others)}."] if others else []
    return time, channels, tuple(notices)


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


def load_record(settings: RecordSettings, folder: Path, sensors: dict[str, Sensor], *, need_file: bool) -> Record:
    """Load one record of an experiment's folder, without its noise, which is filled in later, when all records are there.

    Where no file is needed, a record may lack it, or its channels, if its time stamps are known.

    Raises:
        ExperimentError: the file is missing, damaged or not as it should be, or lacks a channel that the record's kind needs.
    """
    record, path = settings.record, record_path(folder, settings.record.file)
    wanted = wanted_columns(settings, sensors)
    if not file_exists(path, record.file):
        if need_file:
            raise ExperimentError(f"the file of {settings.where} is missing: expected it in the experiment's folder; put it there")
        _check_driving_channels(record, set(), settings.where)
        time = declared_time(record.duration, record.sampling_frequency, settings.where)
        return replace(record, time=time, preparation=Preparation(), notices=("There is no file: the time stamps are those declared.",))
    angles = {name: angle for name in wanted.values() if (angle := read_angle(name)) is not None}
    parts = {column for angle in angles.values() for _, column in angle}
    columns = read_columns(path, frozenset(wanted.values()) | parts, record.file)
    measured = [name for name in columns.values if name != wanted[TIME]]  # a stamp may have the value of a mark
    declared = [one for name in measured for one in without(columns, name, settings.missing, "is {}, which the record declares missing,")]
    columns = with_angles(replace(columns, lost=(*columns.lost, *declared)), angles, settings.where)
    time, raw, unused = assign(columns, wanted, settings, need_channels=need_file)
    stated, odd = stated_unit(TIME, settings.clock.unit, wanted[TIME], columns.units)
    time = time * time_factor(settings, stated)
    lost = [one.sentence(time) for one in columns.lost]
    time, recorded, done = timed(time, raw, settings.clock, record.sampling_frequency, settings.where)
    uneven = check_time(cropped(time, {}, record.preparation, settings.where)[0], settings.where)
    notices = [*columns.notices, *unused, *odd, *lost, *done, *uneven]
    _check_initial_state(settings, float(time[0]))
    channels = {}
    for channel, values in recorded.items():
        sensor = sensors[channel]
        stated, odd = stated_unit(CHANNELS[channel], settings.units.get(channel, sensor.unit), wanted[channel], columns.units)
        factor = channel_factor(channel, sensor, settings, stated)
        marked, lost = mark_unusable(values * (factor * sensor.sign), time, channel, sensor.range)
        notices += [*odd, *lost]
        if np.isfinite(marked).any():
            channels[channel] = marked
            notices += [found.sentence for found in check_saturation(time, marked, channel)]
        else:
            notices.append(f"{channel}: no sample is usable; the channel counts as not recorded.")
    sensed: dict[str, Sensed] = {}
    if record.preparation.words and channels:
        time, channels, sensed, done = prepared(time, channels, record.preparation, settings.where)
        notices.extend(done)
    if need_file:
        check_drive_sampling(record.excitation_frequency, time, settings.where)
    if need_file and not channels:
        raise ExperimentError(f"{settings.where} has no usable sample in any channel: expected some; record it again or remove it")
    _check_driving_channels(record, set(channels), settings.where)
    return replace(record, time=time, channels=channels, sensed=sensed, sha256=sha256_of(path), notices=tuple(notices))


def _check_initial_state(settings: RecordSettings, begin: float) -> None:
    """An initial state is that of the first sample, s, of the file."""
    crop = settings.record.preparation.crop
    for name in ("initial_displacement", "initial_velocity"):
        if crop is not None and crop[0] > begin and getattr(settings.record, name) is not None:
            raise ExperimentError(
                f"{name} in {settings.where} is given beside a crop that begins at {crop[0]:g} s, {crop[0] - begin:g} s after the file: "
                f"expected none, after the crop the stated initial state no longer holds; remove {name}, or begin the crop with the file"
            )


ANSWERS = ("reaction_force", "impact_force", "hammer_acceleration")
"""What a hammer on a prescribed path is compared by: `hammer_acceleration` is then all force on it over its mass."""


def _check_driving_channels(record: Record, channels: set[str], where: str) -> None:
    """A record whose motion is driven by a recorded channel must hold that channel, and beside a prescribed motion what is compared."""
    needed = (
        (record.kind == "forced", ("applied_force",), "is 'forced' and has no applied_force"),
        (record.kind == "prescribed", MOTION_CHANNELS, "is 'prescribed' and its motion is not recorded"),
        (record.kind == "prescribed", ANSWERS, "is 'prescribed' and no force is recorded"),
        (record.base == "measured", CART_CHANNELS, "has base = 'measured' and no recorded cart motion"),
    )
    for applies, any_of, lack in needed:
        if applies and not channels & set(any_of):
            raise ExperimentError(f"{where} {lack}: expected {' or '.join(any_of)}; add its column and its sensor")
