"""In which unit the numbers of one channel of one record are written: the experiment file, the record file, or both may say so."""

from identification.experiment.channels import CHANNELS, TIME, si_unit
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.sensor import Sensor
from identification.experiment.settings.record_settings import RecordSettings
from identification.experiment.units import factor_to_si, same_unit


def channel_factor(channel: str, sensor: Sensor, settings: RecordSettings, stated: str | None) -> float:
    """Find the factor that turns the recorded numbers of a channel into SI.

    `units` of the record overrules everything, for a file whose own statement is wrong. Else the unit that the file states and that of the
    sensor's table must agree, and one of them must be there.

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
    if channel in settings.units:
        return factor_to_si(settings.units[channel], dimension, f"units of {settings.where}")
    overrule = f'units = {{ {channel} = "{sensor.unit or si_unit(channel)}" }} in the record overrules the file'
    if stated is None and sensor.unit is None:
        raise ExperimentError(
            f"unit is missing in {table}, and the file of {settings.where} states none: expected one of {dimension}; "
            f"add a line 'unit = \"{si_unit(channel)}\"'"
        )
    if stated is not None and sensor.unit is None:
        try:
            return factor_to_si(stated, dimension, f"the file of {settings.where} for {channel}")
        except ExperimentError as error:
            raise ExperimentError(f"{error}; {overrule}") from error
    if stated is not None and sensor.unit is not None and not same_unit(stated, sensor.unit, dimension):
        raise ExperimentError(
            f"{settings.where} states {channel} in {shown(stated)} and {table} in {shown(sensor.unit)}: expected one unit; "
            f"correct or remove that of {table}, or {overrule}"
        )
    return factor_to_si(sensor.unit or "", dimension, table)


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
