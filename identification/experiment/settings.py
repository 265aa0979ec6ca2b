"""The tables of `experiment.toml`, checked: suspension, load, parameters, sensors, and each `[[record]]`, whose file is not yet opened."""

from dataclasses import dataclass
from math import pi

from identification.experiment.channels import CHANNELS, KINDS, TIME, factor_to_si, output_of, read_sensitivity, si_unit
from identification.experiment.clock import ClockSettings
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.experiment import Filter, Load, ParameterOption, Preparation, Prior, Sensor, Suspension
from identification.experiment.readers import stem_of
from identification.experiment.toml_file import Table, finite

SUSPENSIONS = ("linear", "pendulum", "pivot", "free")
WITH_LENGTH = ("pendulum", "pivot")


def read_suspension(table: Table) -> Suspension:
    """Read `[suspension]`; a length is needed for those of `WITH_LENGTH`, and refused for the others."""
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
    """Read `[rig]`: constant forces on the hammer that are known; an incline of a body on a bearing is refused."""
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
    """Read the tables `[parameters.NAME]`; whether the chosen law has such a parameter is checked by the fit."""
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
    """Read the tables `[sensors.CHANNEL]`, by channel."""
    sensors = {}
    tables.allow(*CHANNELS, noun="channel")
    for channel in tables.values:
        table = tables.table(channel, f"[sensors.{channel}]")
        table.allow("unit", "sensitivity", "sign", "noise", "zero", "range", *BANDS)
        unit, stated = table.string("unit"), table.string("sensitivity")
        sensitivity = None if stated is None else read_sensitivity(stated, CHANNELS[channel], table.where)
        if unit is not None:
            _ = factor_to_si(unit, CHANNELS[channel], table.where) if sensitivity is None else sensitivity.factor(unit, table.where)
        noise = table.number("noise", unit=si_unit(channel), positive=True)
        zero = table.number("zero", unit=si_unit(channel), positive=True)
        span = _limits(table, "range", f"in {si_unit(channel)}")
        sensors[channel] = Sensor(unit=unit, sensitivity=sensitivity, sign=_sign(table), noise=noise, zero=zero, range=span)
    return sensors


BANDS, FILTERS, MOST_ORDER = ("highpass", "lowpass"), ("butterworth",), 8
SLOWEST_CORNER, FASTEST_CORNER = 1e-6, 1e9
"""Of a declared filter, Hz."""
"""In the order in which readings pass them; shapes of filters; largest order."""


def read_filters(recorder: Table, tables: Table) -> tuple[Filter, ...]:
    """Read `highpass` and `lowpass` of each sensor, then those of `[recorder]`, which act on every channel with a sensor."""
    recorder.allow(*BANDS)
    of_sensors = [one for channel in tables.values for one in _filters(tables.table(channel, f"[sensors.{channel}]"), [channel])]
    return (*of_sensors, *_filters(recorder, list(tables.values)))


def _filters(table: Table, channels: list[str]) -> list[Filter]:
    """The filters of one table, for each of the channels: `lowpass = { type, order, corner }`, or `{ time_constant }` of first order."""
    found = []
    for band in BANDS:
        if band not in table.values:
            continue
        one = table.table(band, f"{band} of {table.where}")
        one.allow("type", "order", "corner", "time_constant")
        order, corner = one.values.get("order", 1), one.quantity("corner", "frequency", example="1100 Hz", positive=True)
        constant = one.quantity("time_constant", "time", example="0.8 s", positive=True)
        if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= MOST_ORDER:
            raise ExperimentError(f"order of {one.where} is {shown(order)}: expected a whole number from 1 to {MOST_ORDER}; correct it")
        if (corner is None) == (constant is None) or (constant is not None and order > 1):
            raise ExperimentError(
                f'{one.where} is not one filter: expected {{ type = "butterworth", order = 4, corner = 1100.0 }} (Hz), or, of first order, '
                "{ time_constant = 0.8 } (s); give one of the two"
            )
        if corner is not None or "type" in one.values:
            one.needed_string("type", FILTERS)
        hertz = corner if corner is not None else 0.5 / (pi * (constant or 1.0))
        if not SLOWEST_CORNER <= hertz <= FASTEST_CORNER:
            raise ExperimentError(
                f"the corner of {one.where} is {hertz:.4g} Hz: expected {SLOWEST_CORNER:g} to {FASTEST_CORNER:g} Hz; correct it"
            )
        found += [Filter(channel=channel, band=band, order=order, corner=hertz) for channel in channels]
    return found


def _sign(table: Table) -> int:
    """Read `sign`, 1 or -1."""
    sign = table.values.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ExperimentError(f"sign in {table.where} is {shown(sign)}: expected 1 or -1; write sign = -1 to turn the channel round")
    return int(sign)


def _limits(table: Table, key: str, unit: str) -> tuple[float, float] | None:
    """Read an optional `key = [lo, hi]`; `unit` is "in N", or words in its place."""
    return _rising(table, key, unit, wanted="numbers", first="lower number", written="[lowest, highest]")


def _rising(table: Table, key: str, unit: str, *, wanted: str, first: str, written: str) -> tuple[float, float] | None:
    """Read an optional list of two rising numbers, in the words of its messages."""
    if key not in table.values:
        return None
    value, given = table.values[key], f"{key} in {table.where}"
    if not isinstance(value, list) or len(value) != 2:
        raise ExperimentError(f"{given} is {shown(value)}: expected two {wanted} {unit}; write {key} = {written}")
    low, high = (finite(each, given, unit=unit.removeprefix("in ")) for each in value)
    if low >= high:
        raise ExperimentError(f"{given} is {shown(value)}: expected the {first} first; write {key} = {written}")
    return low, high


TRENDS = ("constant", "linear")


def read_preparation(table: Table) -> Preparation:
    """Read `crop`, `mask`, `lowpass`, `decimate`, `resample` and `detrend` of a record; empty where none is declared."""
    decimate = table.values.get("decimate")
    if decimate is not None and (isinstance(decimate, bool) or not isinstance(decimate, int) or decimate < 2):
        raise ExperimentError(f"decimate in {table.where} is {shown(decimate)}: expected a whole number of at least 2; correct it")
    resample = table.number("resample", unit="Hz", positive=True)
    if decimate is not None and resample is not None:
        raise ExperimentError(f"{table.where} has both decimate and resample: expected one of the two; remove one")
    return Preparation(
        crop=_rising(table, "crop", "in s", wanted="instants", first="earlier instant", written="[first, last]"),
        mask=_mask(table),
        lowpass=table.number("lowpass", unit="Hz", positive=True),
        decimate=decimate,
        resample=resample,
        detrend=_detrend(table),
    )


def _mask(table: Table) -> tuple[tuple[float, float], ...]:
    """Read `mask = [[first, last], ...]`, s."""
    spans, written = table.values.get("mask", []), "[[first, last]]"
    if not isinstance(spans, list) or any(not isinstance(span, list) for span in spans):
        raise ExperimentError(f"mask in {table.where} is {shown(spans)}: expected a list of stretches in s; write mask = {written}")
    each = (Table(values={"mask": span}, where=table.where) for span in spans)
    found = (_rising(one, "mask", "in s", wanted="instants", first="earlier instant", written=written) for one in each)
    return tuple(span for span in found if span is not None)


def _missing(table: Table) -> tuple[float, ...]:
    """Read `missing`, a number or a list of them."""
    value = table.values.get("missing", [])
    return tuple(finite(each, f"missing in {table.where}") for each in (value if isinstance(value, list) else [value]))


def _detrend(table: Table) -> dict[str, str]:
    """Read `detrend = { channel = "linear" }`."""
    trends = table.table("detrend", f"detrend of {table.where}")
    trends.allow(*CHANNELS, noun="channel")
    return {channel: trends.needed_string(channel, TRENDS) for channel in trends.values}


UNDRIVEN = ("drop-test", "free-decay")
"""Kinds in which nothing drives, unless the cart's motion was measured."""
BASES = ("sine", "measured")
NUMBERS = {"base_amplitude": "m", "base_phase": "rad", "initial_displacement": "m", "initial_velocity": "m/s"}
POSITIVE_NUMBERS = {"excitation_frequency": "375 rpm", "duration": "2 s", "sampling_frequency": "4 kHz"}
"""With an example; a number without a unit is in Hz or s."""
CLOCK = ("time_unit", "drop_bad_time", "rebuild_time", "stretch")
PREPARATION = ("crop", "mask", "lowpass", "decimate", "resample", "detrend")
KEYS = (
    "file",
    "kind",
    "gap",
    "base",
    "held_back",
    "columns",
    "units",
    *CLOCK,
    "missing",
    *NUMBERS,
    *POSITIVE_NUMBERS,
    *PREPARATION,
)


@dataclass(frozen=True, kw_only=True)
class RecordSettings:
    """What the experiment file declares about one record.

    Attributes:
        file: path inside the experiment's folder.
        kind: one of `KINDS`.
        gap: m.
        base: "sine" or "measured".
        numbers: the optional numbers of `NUMBERS` and `POSITIVE_NUMBERS`, SI, None where absent.
        columns: the column that holds a channel (or "time"), where it does not bear the channel's name.
        units: the unit of a channel's numbers in this file, where neither the file nor the sensor's table is to be believed.
        clock: of its time stamps.
        missing: values that stand for no reading, in the units of the file.
        held_back: whether the record is to be predicted, not fitted.
        preparation: of its samples.
    """

    file: str
    kind: str
    gap: float
    base: str
    numbers: dict[str, float | None]
    columns: dict[str, str]
    units: dict[str, str]
    clock: ClockSettings
    missing: tuple[float, ...]
    held_back: bool
    preparation: Preparation

    @property
    def where(self) -> str:
        """How messages name the record."""
        return f"record {shown(self.file)}"


def read_record_settings(values: object, number: int) -> RecordSettings:
    """Check one `[[record]]` table as parsed, the `number`-th of the experiment file, from 1."""
    if not isinstance(values, dict):
        raise ExperimentError(f"record number {number} is {shown(values)}: expected a table; write [[record]] and its keys below")
    name = values.get("file")
    table = Table(values=values, where=f"record {shown(name)}" if isinstance(name, str) else f"record number {number}")
    table.allow(*KEYS)
    file = table.needed_string("file")
    if not stem_of(file):
        raise ExperimentError(f"file in {table.where} has no name before its suffix: expected a name such as 'drop.csv'; rename the file")
    kind = table.needed_string("kind", KINDS)
    base = table.string("base", BASES) or "sine"
    numbers = {key: table.number(key, unit=unit) for key, unit in NUMBERS.items()}
    for key, example in POSITIVE_NUMBERS.items():
        numbers[key] = table.quantity(key, "time" if key == "duration" else "frequency", example=example, positive=True)
    if kind == "cart-excitation" and base == "sine" and numbers["excitation_frequency"] is None:
        table.needed_number("excitation_frequency", unit="Hz", positive=True)
    if kind in UNDRIVEN and base == "sine" and numbers["excitation_frequency"] is not None:
        raise ExperimentError(
            f"excitation_frequency in {table.where} is given for kind {shown(kind)}, in which the cart rests: expected none; remove it, or"
            " set kind = 'cart-excitation'"
        )
    return RecordSettings(
        file=file,
        kind=kind,
        gap=table.needed_number("gap", unit="m"),
        base=base,
        numbers=numbers,
        columns=_columns(table),
        units=_units(table),
        clock=_clock(table),
        missing=_missing(table),
        held_back=table.flag("held_back"),
        preparation=read_preparation(table),
    )


def _clock(table: Table) -> ClockSettings:
    """Read `time_unit`, `drop_bad_time`, `rebuild_time` and `stretch`."""
    unit, stretch = table.string("time_unit"), table.values.get("stretch")
    factor_to_si(unit or "s", TIME, table.where)
    if stretch is not None and (isinstance(stretch, bool) or not isinstance(stretch, int) or stretch < 1):
        raise ExperimentError(f"stretch in {table.where} is {shown(stretch)}: expected a whole number from 1 on; correct it")
    drop, rebuild = table.flag("drop_bad_time"), table.flag("rebuild_time")
    if drop and rebuild:
        raise ExperimentError(f"{table.where} has both drop_bad_time and rebuild_time: expected one of the two; remove one")
    return ClockSettings(unit=unit, drop_bad=drop, rebuild=rebuild, stretch=stretch)


def _units(table: Table) -> dict[str, str]:
    """Read `units = { channel = "unit" }`."""
    units = table.table("units", f"units of {table.where}")
    found: dict[str, str] = {}
    units.allow(*CHANNELS, noun="channel")
    for channel in units.values:
        found[channel] = units.needed_string(channel)
        if not output_of(found[channel]):  # of a sensor, whose sensitivity is not known here
            factor_to_si(found[channel], CHANNELS[channel], units.where)
    return found


def _columns(table: Table) -> dict[str, str]:
    """Read `columns = { channel = "column name" }`."""
    columns = table.table("columns", f"columns of {table.where}")
    names: dict[str, str] = {}
    columns.allow(TIME, *CHANNELS, noun="channel")
    for channel in columns.values:
        name = columns.needed_string(channel)
        if name in names.values():
            raise ExperimentError(f"column {shown(name)} in {columns.where} is named twice: expected one channel each; remove one")
        names[channel] = name
    return names
