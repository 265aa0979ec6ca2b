"""One `[[record]]` table of the experiment file, checked but its file not yet opened."""

from dataclasses import dataclass

from identification.experiment.channels import CHANNELS, KINDS, TIME
from identification.experiment.errors import ExperimentError, shown, suggestion
from identification.experiment.readers import stem_of
from identification.experiment.record import Preparation
from identification.experiment.settings.preparation_settings import read_preparation
from identification.experiment.settings.schema import Table
from identification.experiment.units import factor_to_si, output_of

UNDRIVEN = ("drop-test", "free-decay")
"""Kinds in which nothing drives, unless the cart's motion was measured."""
BASES = ("sine", "measured")
NUMBERS = {"base_amplitude": "m", "base_phase": "rad", "initial_displacement": "m", "initial_velocity": "m/s"}
POSITIVE_NUMBERS = {"excitation_frequency": "Hz", "duration": "s", "sampling_frequency": "Hz"}
PREPARATION = ("crop", "lowpass", "decimate", "resample", "detrend")
KEYS = (
    "file",
    "kind",
    "gap",
    "base",
    "held_back",
    *NUMBERS,
    *POSITIVE_NUMBERS,
    "columns",
    "units",
    "time_unit",
    "drop_bad_time",
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
        time_unit: of the time column, or None.
        drop_bad_time: whether samples without a time stamp, or with that of the sample before, are to be left out.
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
    time_unit: str | None
    drop_bad_time: bool
    held_back: bool
    preparation: Preparation

    @property
    def where(self) -> str:
        """How messages name the record."""
        return f"record {shown(self.file)}"


def read_record_settings(values: object, number: int) -> RecordSettings:
    """Check one `[[record]]` table.

    Args:
        values: the table as parsed.
        number: its place in the experiment file, from 1.

    Returns:
        The settings.

    Raises:
        ExperimentError: something in it is missing, unknown or of the wrong type.
    """
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
    numbers |= {key: table.number(key, unit=unit, positive=True) for key, unit in POSITIVE_NUMBERS.items()}
    if kind == "cart-excitation" and base == "sine":
        table.needed_number("excitation_frequency", unit="Hz", positive=True)
    if kind in UNDRIVEN and base == "sine" and numbers["excitation_frequency"] is not None:
        raise ExperimentError(
            f"excitation_frequency in {table.where} is given for kind {shown(kind)}, in which the cart rests: expected none; remove it, or"
            " set kind = 'cart-excitation'"
        )
    time_unit = table.string("time_unit")
    factor_to_si(time_unit or "s", TIME, table.where)
    return RecordSettings(
        file=file,
        kind=kind,
        gap=table.needed_number("gap", unit="m"),
        base=base,
        numbers=numbers,
        columns=_columns(table),
        units=_units(table),
        time_unit=time_unit,
        drop_bad_time=table.flag("drop_bad_time"),
        held_back=table.flag("held_back"),
        preparation=read_preparation(table),
    )


def _units(table: Table) -> dict[str, str]:
    """Read `units = { channel = "unit" }`."""
    units = table.table("units", f"units of {table.where}")
    found: dict[str, str] = {}
    for channel in units.values:
        if channel not in CHANNELS:
            raise ExperimentError(f"unknown channel {shown(channel)} in {units.where}{suggestion(channel, CHANNELS)}")
        found[channel] = units.needed_string(channel)
        if not output_of(found[channel]):  # of a sensor, whose sensitivity is not known here
            factor_to_si(found[channel], CHANNELS[channel], units.where)
    return found


def _columns(table: Table) -> dict[str, str]:
    """Read `columns = { channel = "column name" }`."""
    columns = table.table("columns", f"columns of {table.where}")
    names: dict[str, str] = {}
    for channel in columns.values:
        if channel not in CHANNELS and channel != TIME:
            raise ExperimentError(f"unknown channel {shown(channel)} in {columns.where}{suggestion(channel, (TIME, *CHANNELS))}")
        name = columns.needed_string(channel)
        if name in names.values():
            raise ExperimentError(f"column {shown(name)} in {columns.where} is named twice: expected one channel each; remove one")
        names[channel] = name
    return names
