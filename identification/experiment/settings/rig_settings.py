"""The experiment file's tables on the rig: suspension, parameters, sensors."""

from math import pi

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.errors import ExperimentError, listed, shown, suggestion
from identification.experiment.rig import Load, ParameterOption, Suspension
from identification.experiment.sensor import Sensor
from identification.experiment.settings.schema import Table, finite
from identification.experiment.units import factor_to_si

SUSPENSIONS = ("linear", "pendulum", "pivot", "free")
WITH_LENGTH = ("pendulum", "pivot")


def read_suspension(table: Table) -> Suspension:
    """Read `[suspension]`.

    Args:
        table: the table.

    Returns:
        The suspension; its length is set for those of `WITH_LENGTH` only.

    Raises:
        ExperimentError: unknown kind, a pendulum without length, or a length that would have no meaning.
    """
    table.allow("kind", "length")
    kind = table.needed_string("kind", SUSPENSIONS)
    if kind in WITH_LENGTH:
        return Suspension(kind=kind, length=table.needed_number("length", unit="m", positive=True))
    if "length" in table.values:
        raise ExperimentError(
            f"length in {table.where} is given for kind {shown(kind)}: expected only with {listed(WITH_LENGTH)}; remove it"
        )
    return Suspension(kind=kind)


def read_load(table: Table, suspension: Suspension) -> Load:
    """Read `[rig]`: constant forces on the hammer that are known.

    Args:
        table: the table; empty where nothing is known.
        suspension: how the hammer hangs.

    Returns:
        The load.

    Raises:
        ExperimentError: unknown key, a value without its unit or out of range, or an incline of a body on a bearing.
    """
    table.allow("incline", "constant_force")
    incline = table.quantity("incline", "angle", example="5 deg", bare=False) or 0.0
    if abs(incline) > pi / 2:
        raise ExperimentError(f"incline in {table.where} is {shown(table.values['incline'])}: expected at most 90 deg; correct it")
    if incline and suspension.kind == "pivot":
        raise ExperimentError(
            f"incline in {table.where} is given for a pivot, whose angle counts from where gravity lets it hang: expected none; remove it, "
            "and for a sensor whose zero lies elsewhere set its 'zero'"
        )
    return Load(incline=incline, constant_force=table.quantity("constant_force", "force", example="0.2 N") or 0.0)


def read_parameters(tables: Table) -> dict[str, ParameterOption]:
    """Read the tables `[parameters.NAME]`; whether the chosen law has such a parameter is checked by the fit.

    Args:
        tables: the table of tables.

    Returns:
        The options by parameter name.

    Raises:
        ExperimentError: unknown key, or a parameter fixed without a start.
    """
    options = {}
    for name in tables.values:
        table = tables.table(name, f"[parameters.{name}]")
        table.allow("start", "fixed")
        option = ParameterOption(start=table.number("start"), fixed=table.flag("fixed"))
        if option.fixed and option.start is None:
            raise ExperimentError(f"{table.where} is fixed without a value: expected 'start' beside 'fixed'; add a line 'start = …'")
        options[name] = option
    return options


def read_sensors(tables: Table) -> dict[str, Sensor]:
    """Read the tables `[sensors.CHANNEL]`.

    Args:
        tables: the table of tables.

    Returns:
        The sensors by channel name.

    Raises:
        ExperimentError: unknown channel, unit of another dimension, noise or zero not above 0, or a range that is not two rising numbers.
    """
    sensors = {}
    for channel in tables.values:
        if channel not in CHANNELS:
            raise ExperimentError(f"unknown channel {shown(channel)} in {tables.where}{suggestion(channel, CHANNELS)}")
        table = tables.table(channel, f"[sensors.{channel}]")
        table.allow("unit", "sign", "noise", "zero", "range")
        unit = table.string("unit")
        if unit is not None:
            factor_to_si(unit, CHANNELS[channel], table.where)
        noise = table.number("noise", unit=si_unit(channel), positive=True)
        zero = table.number("zero", unit=si_unit(channel), positive=True)
        sensors[channel] = Sensor(unit=unit, sign=_sign(table), noise=noise, zero=zero, range=_range(table, si_unit(channel)))
    return sensors


def _sign(table: Table) -> int:
    """Read `sign`, 1 or -1."""
    sign = table.values.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ExperimentError(f"sign in {table.where} is {shown(sign)}: expected 1 or -1; write sign = -1 to turn the channel round")
    return int(sign)


def _range(table: Table, unit: str) -> tuple[float, float] | None:
    """Read `range = [lo, hi]`, in SI."""
    if "range" not in table.values:
        return None
    value = table.values["range"]
    if not isinstance(value, list) or len(value) != 2:
        raise ExperimentError(f"range in {table.where} is {shown(value)}: expected two numbers in {unit}; write range = [lowest, highest]")
    low, high = (finite(each, f"range in {table.where}", unit=unit) for each in value)
    if low >= high:
        raise ExperimentError(f"range in {table.where} is {shown(value)}: expected the lower number first; write range = [lowest, highest]")
    return low, high
