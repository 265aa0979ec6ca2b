"""In which unit the numbers of one channel of one record are written: the experiment file, the record file, or both may say so."""

from collections.abc import Mapping

from identification.experiment.channels import CHANNELS, TIME, si_unit
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.sensitivity import example
from identification.experiment.sensor import Sensor
from identification.experiment.settings.record_settings import RecordSettings
from identification.experiment.units import factor_to_si, output_of, same_unit, unit_in_name


def stated_unit(dimension: str, declared: str | None, column: str, units: Mapping[str, str]) -> tuple[str | None, tuple[str, ...]]:
    """The unit that a file states for a column, and what is odd about it.

    Brackets behind the column's name count as its statement. Where the experiment file contradicts them by a factor only, it counts, since
    names are often copied from another table.

    Args:
        dimension: of the channel, or "time".
        declared: the unit in the experiment file; None where it declares none.
        column: its name.
        units: that the file states beside the names, by column.

    Returns:
        The unit, None where the file is silent; and a sentence, if there is a contradiction.

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
    """Find the factor that turns the recorded numbers of a channel into SI.

    `units` of the record overrules everything, for a file whose own statement is wrong, or whose numbers are no sensor's output. Else the
    unit that the file states and that of the sensor's table must agree, and one of them must be there. A sensor with a sensitivity has
    units of its output, by default that of its sensitivity.

    Args:
        channel: its name.
        sensor: its table.
        settings: of the record.
        stated: the unit that the record's file itself states; None where it is silent.

    Returns:
        SI value of one unit.

    Raises:
        ExperimentError: no unit, two that differ, or one that is unknown or of another dimension.
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
    """Find the factor that turns the recorded time stamps into seconds: `time_unit` of the record, else what the file states, else s.

    Args:
        settings: of the record.
        stated: the unit that the record's file itself states; None where it is silent.

    Returns:
        Seconds in one unit.

    Raises:
        ExperimentError: the unit is unknown.
    """
    if settings.time_unit is not None or stated is None:
        return factor_to_si(settings.time_unit or "s", TIME, settings.where)
    try:
        return factor_to_si(stated, TIME, f"the file of {settings.where} for its time")
    except ExperimentError as error:
        raise ExperimentError(f"{error}; time_unit in the record overrules the file") from error
