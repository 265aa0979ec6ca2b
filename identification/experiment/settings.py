"""The tables of `experiment.toml`, checked: suspension, load, parameters, sensors, and each `[[record]]`, whose file is not yet opened."""

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from identification.experiment.channels import AT_REST, CHANNELS, KINDS, TIME, factor_to_si, output_of, read_sensitivity, si_unit
from identification.experiment.clock import ClockSettings
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.experiment import Filter, Load, ParameterOption, Preparation, Prior, Record, Sensor, Suspension
from identification.experiment.readers import stem_of
from identification.experiment.toml_file import Table, finite

SUSPENSIONS = ("linear", "pendulum", "pivot", "free")


def read_suspension(table: Table) -> Suspension:
    """Read `[suspension]`; a length is needed for a pendulum and a pivot, and refused for the others."""
    table.allow("kind", "length")
    kind = table.needed_string("kind", SUSPENSIONS)
    if kind in ("pendulum", "pivot"):
        return Suspension(kind=kind, length=table.needed_number("length", unit="m", positive=True))
    if "length" in table.values:
        raise ExperimentError(f"length in {table.where} is given for kind {shown(kind)}: expected only with pendulum, pivot; remove it")
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
        start, bounds, prior = table.number("start"), table.interval("bounds", "in the parameter's unit"), None
        fixed, varies = table.flag("fixed"), table.flag("varies")
        if "prior" in table.values:
            normal = table.table("prior", f"prior of {table.where}")
            normal.allow("mean", "std")
            prior = Prior(mean=normal.needed_number("mean", unit=""), std=normal.needed_number("std", unit="", positive=True))
        if fixed and start is None:
            raise ExperimentError(f"{table.where} is fixed without a value: expected 'start' beside 'fixed'; add a line 'start = …'")
        for wish in ("prior", "varies"):
            if fixed and table.values.get(wish):
                raise ExperimentError(
                    f"{table.where} is fixed and has '{wish}': expected one of the two, a fixed parameter does not move; remove one"
                )
        for what, value in {"start": start, "mean of the prior": None if prior is None else prior.mean}.items():
            if bounds is not None and value is not None and not bounds[0] <= value <= bounds[1]:
                limits = f"{bounds[0]:g} to {bounds[1]:g}"
                raise ExperimentError(f"the {what} in {table.where} is {value:g}, outside its bounds {limits}: correct one of them")
        options[name] = ParameterOption(start=start, fixed=fixed, bounds=bounds, prior=prior, varies=varies)
    return options


def read_sensors(tables: Table) -> dict[str, Sensor]:
    """Read the tables `[sensors.CHANNEL]`, by channel."""
    sensors = {}
    tables.allow(*CHANNELS, noun="channel")
    for channel in tables.values:
        table = tables.table(channel, f"[sensors.{channel}]")
        table.allow("unit", "sensitivity", "sign", "noise", "zero", "range", *BANDS)
        unit, stated, si = table.string("unit"), table.string("sensitivity"), si_unit(channel)
        sensitivity = None if stated is None else read_sensitivity(stated, CHANNELS[channel], table.where)
        if unit is not None:
            _ = factor_to_si(unit, CHANNELS[channel], table.where) if sensitivity is None else sensitivity.factor(unit, table.where)
        sign = table.values.get("sign", 1)
        if isinstance(sign, bool) or sign not in (1, -1):
            raise ExperimentError(f"sign in {table.where} is {shown(sign)}: expected 1 or -1; write sign = -1 to turn the channel round")
        sensors[channel] = Sensor(
            unit=unit,
            sensitivity=sensitivity,
            sign=int(sign),
            noise=table.number("noise", unit=si, positive=True),
            zero=table.number("zero", unit=si, positive=True),
            range=table.interval("range", f"in {si}"),
        )
    return sensors


BANDS = ("highpass", "lowpass")
"""In the order in which readings pass them."""


def read_filters(recorder: Table, tables: Table) -> tuple[Filter, ...]:
    """Read `highpass` and `lowpass` of each sensor, then those of `[recorder]`, which act on every channel with a sensor."""
    recorder.allow(*BANDS)
    of_sensors = [one for channel in tables.values for one in _filters(tables.table(channel, f"[sensors.{channel}]"), [channel])]
    return (*of_sensors, *_filters(recorder, list(tables.values)))


def _filters(table: Table, channels: list[str]) -> list[Filter]:
    """The filters of one table, for each of the channels: `lowpass = { type, order, corner }`, or `{ time_constant }` of first order."""
    found = []
    for band in (band for band in BANDS if band in table.values):
        one = table.table(band, f"{band} of {table.where}")
        one.allow("type", "order", "corner", "time_constant")
        corner = one.quantity("corner", "frequency", example="1100 Hz", positive=True)
        constant = one.quantity("time_constant", "time", example="0.8 s", positive=True)
        order = one.whole("order", 1, 8) or 1
        if (corner is None) == (constant is None) or (constant is not None and order > 1):
            raise ExperimentError(
                f'{one.where} is not one filter: expected {{ type = "butterworth", order = 4, corner = 1100.0 }} (Hz), or, of first order, '
                "{ time_constant = 0.8 } (s); give one of the two"
            )
        if corner is not None or "type" in one.values:
            one.needed_string("type", ("butterworth",))
        hertz = corner if corner is not None else 0.5 / (pi * (constant or 1.0))
        if not 1e-6 <= hertz <= 1e9:
            raise ExperimentError(f"the corner of {one.where} is {hertz:.4g} Hz: expected 1e-06 to 1e+09 Hz; correct it")
        found += [Filter(channel=channel, band=band, order=order, corner=hertz) for channel in channels]
    return found


def read_preparation(table: Table) -> Preparation:
    """Read `crop`, `mask`, `lowpass`, `decimate`, `resample` and `detrend` of a record; empty where none is declared."""
    decimate, resample = table.whole("decimate", 2), table.number("resample", unit="Hz", positive=True)
    if decimate is not None and resample is not None:
        raise ExperimentError(f"{table.where} has both decimate and resample: expected one of the two; remove one")
    spans = table.values.get("mask", [])
    if not isinstance(spans, list) or any(not isinstance(span, list) for span in spans):
        raise ExperimentError(f"mask in {table.where} is {shown(spans)}: expected a list of stretches in s; write mask = [[first, last]]")
    masks = (Table(values={"mask": span}, where=table.where).interval("mask", "in s", "[[lower, higher]]") for span in spans)
    return Preparation(
        crop=table.interval("crop", "in s"),
        mask=tuple(span for span in masks if span is not None),
        lowpass=table.number("lowpass", unit="Hz", positive=True),
        decimate=decimate,
        resample=resample,
        detrend=table.strings("detrend", CHANNELS, ("constant", "linear")),
    )


NUMBERS = {"base_amplitude": "m", "base_phase": "rad", "initial_displacement": "m", "initial_velocity": "m/s"}
QUANTITIES = {"excitation_frequency": ("frequency", "375 rpm"), "duration": ("time", "2 s"), "sampling_frequency": ("frequency", "4 kHz")}
"""Above 0; each with its dimension and an example. A number without a unit is in Hz or s."""
CLOCK = ("time_unit", "drop_bad_time", "rebuild_time", "stretch")
PREPARATION = ("crop", "mask", "lowpass", "decimate", "resample", "detrend")
KEYS = ("file", "kind", "gap", "base", "held_back", "columns", "units", *CLOCK, "missing", *NUMBERS, *QUANTITIES, *PREPARATION)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordSettings:
    """What the experiment file declares about one record.

    Attributes:
        record: as declared, still without samples.
        columns: the column that holds a channel (or "time"), where it does not bear the channel's name.
        units: the unit of a channel's numbers in this file, where neither the file nor the sensor's table is to be believed.
        clock: of its time stamps.
        missing: values that stand for no reading, in the units of the file.
    """

    record: Record
    columns: dict[str, str]
    units: dict[str, str]
    clock: ClockSettings
    missing: tuple[float, ...]

    @property
    def where(self) -> str:
        """How messages name the record."""
        return f"record {shown(self.record.file)}"


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
    base = table.string("base", ("sine", "measured")) or "sine"
    numbers: dict[str, Any] = {key: table.number(key, unit=unit) for key, unit in NUMBERS.items()}
    for key, (dimension, example) in QUANTITIES.items():
        numbers[key] = table.quantity(key, dimension, example=example, positive=True)
    if kind == "cart-excitation" and base == "sine" and numbers["excitation_frequency"] is None:
        table.needed_number("excitation_frequency", unit="Hz", positive=True)
    if kind in AT_REST and base == "sine" and numbers["excitation_frequency"] is not None:
        raise ExperimentError(
            f"excitation_frequency in {table.where} is given for kind {shown(kind)}, in which the cart rests: expected none; remove it, or"
            " set kind = 'cart-excitation'"
        )
    columns, units, missing = table.strings("columns", (TIME, *CHANNELS)), table.strings("units", CHANNELS), values.get("missing", [])
    for name in columns.values():
        if list(columns.values()).count(name) > 1:
            raise ExperimentError(f"column {shown(name)} in columns of {table.where} is named twice: expected one channel each; remove one")
    for channel, unit in units.items():
        if not output_of(unit):  # of a sensor, whose sensitivity is not known here
            factor_to_si(unit, CHANNELS[channel], f"units of {table.where}")
    record = Record(
        file=file,
        kind=kind,
        gap=table.needed_number("gap", unit="m"),
        base=base,
        time=np.empty(0),
        held_back=table.flag("held_back"),
        preparation=read_preparation(table),
        **numbers,
    )
    return RecordSettings(
        record=record,
        columns=columns,
        units=units,
        clock=_clock(table),
        missing=tuple(finite(each, f"missing in {table.where}") for each in (missing if isinstance(missing, list) else [missing])),
    )


def _clock(table: Table) -> ClockSettings:
    """Read `time_unit`, `drop_bad_time`, `rebuild_time` and `stretch`."""
    unit, stretch = table.string("time_unit"), table.whole("stretch", 1)
    factor_to_si(unit or "s", TIME, table.where)
    drop, rebuild = table.flag("drop_bad_time"), table.flag("rebuild_time")
    if drop and rebuild:
        raise ExperimentError(f"{table.where} has both drop_bad_time and rebuild_time: expected one of the two; remove one")
    return ClockSettings(unit=unit, drop_bad=drop, rebuild=rebuild, stretch=stretch)
