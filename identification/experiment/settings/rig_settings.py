"""The experiment file's tables on the rig: suspension, parameters, sensors."""

from math import pi

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.errors import ExperimentError, listed, shown, suggestion
from identification.experiment.rig import Load, ParameterOption, Prior, Suspension
from identification.experiment.sensitivity import read_sensitivity
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
        ExperimentError: unknown key, a value of the wrong kind, or wishes that contradict one another.
    """
    options = {}
    for name in tables.values:
        table = tables.table(name, f"[parameters.{name}]")
        table.allow("start", "fixed", "bounds", "prior", "varies")
        option = ParameterOption(
            start=table.number("start"),
            fixed=table.flag("fixed"),
            bounds=_limits(table, "bounds", "in the parameter's unit"),
            prior=_prior(table),
            varies=table.flag("varies"),
        )
        _check_agreement(option, table.where)
        options[name] = option
    return options


def _prior(table: Table) -> Prior | None:
    """Read `prior = { mean, std }`."""
    if "prior" not in table.values:
        return None
    prior = table.table("prior", f"prior of {table.where}")
    prior.allow("mean", "std")
    return Prior(mean=prior.needed_number("mean", unit=""), std=prior.needed_number("std", unit="", positive=True))


def _check_agreement(option: ParameterOption, where: str) -> None:
    """Refuse wishes for one parameter that contradict one another."""
    if option.fixed:
        if option.start is None:
            raise ExperimentError(f"{where} is fixed without a value: expected 'start' beside 'fixed'; add a line 'start = …'")
        for wish, given in {"prior": option.prior is not None, "varies": option.varies}.items():
            if given:
                raise ExperimentError(
                    f"{where} is fixed and has '{wish}': expected one of the two, a fixed parameter does not move; remove one"
                )
    if option.bounds is None:
        return
    low, high = option.bounds
    prior = None if option.prior is None else option.prior.mean
    for what, value in {"start": option.start, "mean of the prior": prior}.items():
        if value is not None and not low <= value <= high:
            raise ExperimentError(f"the {what} in {where} is {value:g}, outside its bounds {low:g} to {high:g}: correct one of them")


def read_sensors(tables: Table) -> dict[str, Sensor]:
    """Read the tables `[sensors.CHANNEL]`.

    Args:
        tables: the table of tables.

    Returns:
        The sensors by channel name.

    Raises:
        ExperimentError: unknown channel, unit of another dimension, an unreadable sensitivity, noise or zero not above 0, or a range
            that is not two rising numbers.
    """
    sensors = {}
    for channel in tables.values:
        if channel not in CHANNELS:
            raise ExperimentError(f"unknown channel {shown(channel)} in {tables.where}{suggestion(channel, CHANNELS)}")
        table = tables.table(channel, f"[sensors.{channel}]")
        table.allow("unit", "sensitivity", "sign", "noise", "zero", "range")
        unit, stated = table.string("unit"), table.string("sensitivity")
        sensitivity = None if stated is None else read_sensitivity(stated, CHANNELS[channel], table.where)
        if unit is not None:
            _ = factor_to_si(unit, CHANNELS[channel], table.where) if sensitivity is None else sensitivity.factor(unit, table.where)
        noise = table.number("noise", unit=si_unit(channel), positive=True)
        zero = table.number("zero", unit=si_unit(channel), positive=True)
        span = _limits(table, "range", f"in {si_unit(channel)}")
        sensors[channel] = Sensor(unit=unit, sensitivity=sensitivity, sign=_sign(table), noise=noise, zero=zero, range=span)
    return sensors


def _sign(table: Table) -> int:
    """Read `sign`, 1 or -1."""
    sign = table.values.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ExperimentError(f"sign in {table.where} is {shown(sign)}: expected 1 or -1; write sign = -1 to turn the channel round")
    return int(sign)


def _limits(table: Table, key: str, unit: str) -> tuple[float, float] | None:
    """Read an optional `key = [lo, hi]`."""
    if key not in table.values:
        return None
    value = table.values[key]
    if not isinstance(value, list) or len(value) != 2:
        raise ExperimentError(f"{key} in {table.where} is {shown(value)}: expected two numbers {unit}; write {key} = [lowest, highest]")
    low, high = (finite(each, f"{key} in {table.where}", unit=unit.removeprefix("in ")) for each in value)
    if low >= high:
        raise ExperimentError(f"{key} in {table.where} is {shown(value)}: expected the lower number first; write {key} = [lowest, highest]")
    return low, high
