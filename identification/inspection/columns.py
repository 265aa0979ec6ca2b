"""All columns of a file, read leniently: what cannot be used is named with its reason."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import TIME, means_time
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.readers import read_columns
from identification.experiment.readers.apart import TooCostlyError
from identification.experiment.units import FACTORS, brackets_of, factor_to_si, same_unit

SAME_TIME = 0.01
LONG_STEP = 0.05
"""s: a median step above is more likely written in a smaller unit, for an impact lasts milliseconds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """One column of a file.

    Attributes:
        name: in the file.
        unit: as the file or the name's end states it ("LVDT 2 [mm]"); empty where neither does.
        in_file: whether the file itself states the unit, beside the name.
        values: as recorded, shape (samples,).
    """

    name: str
    unit: str
    in_file: bool
    values: Float64[np.ndarray, " samples"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FileColumns:
    """What one file holds.

    Attributes:
        file: its name.
        time: the column of time stamps; where the file has none, one without name that counts the samples.
        time_unit: of these stamps.
        time_guessed: why the unit is a guess; empty where it was stated, or is s as it is without a statement.
        columns: the others on the same time axis.
        unusable: why a column cannot be used, by name.
    """

    file: str
    time: Column
    time_unit: str
    time_guessed: str
    columns: tuple[Column, ...]
    unusable: dict[str, str] = field(default_factory=dict)

    @property
    def untimed(self) -> bool:
        """Whether the file has no time stamps: its times are then numbers of samples."""
        return not self.time.name

    @property
    def time_factor(self) -> float:
        """Seconds per unit of the time stamps."""
        return factor_to_si(self.time_unit, TIME, self.file)

    @property
    def seconds(self) -> Float64[np.ndarray, " samples"]:
        """Time stamps in s."""
        return self.time.values * self.time_factor


def read_file(path: Path) -> FileColumns:
    """Read a file of any known format.

    Args:
        path: an existing file.

    Returns:
        Its columns.

    Raises:
        ExperimentError: it cannot be read, or holds nothing beside time stamps.
    """
    names = read_columns(path, frozenset(), path.name).names
    found, own_time, unusable = _read_all(path, names)
    time = _time_column(found)
    unit, guessed = _time_unit(time) if time.name else ("s", "")
    columns = []
    for column in found:
        stamps = own_time.get(column.name, time.values)
        if column.name == time.name:
            continue
        if column.values.size != time.values.size or not _same(stamps, time.values):
            unusable[column.name] = f"{column.values.size} samples on another time axis: resample it to that of the others and export again"
        else:
            columns.append(column)
    if not columns:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in unusable.items())[:200] or "there is none"
        raise ExperimentError(
            f"{shown(path.name)} has no usable column beside the time ({reasons}): expected at least one; export it again"
        )
    return FileColumns(file=path.name, time=time, time_unit=unit, time_guessed=guessed, columns=tuple(columns), unusable=unusable)


def _read_all(path: Path, names: tuple[str, ...]) -> tuple[list[Column], dict[str, np.ndarray], dict[str, str]]:
    """All columns at once; where that fails, each with its own time axis, so that one bad column spoils no other."""
    try:
        everything = read_columns(path, frozenset(names), path.name)
        return [_column(name, everything.values[name], everything.units) for name in names if name in everything.values], {}, {}
    except TooCostlyError:
        raise
    except ExperimentError as error:
        first = error
    found, own_time, unusable, time_unit = [], {}, {}, "s"
    for name in names:
        try:
            one = read_columns(path, frozenset({name, TIME}), path.name)
            own_time |= {name: one.values[TIME]} if TIME in one.values else {}
            time_unit = one.units.get(TIME, time_unit)
            found += [_column(name, one.values[name], one.units)] if name in one.values else []
        except ExperimentError as error:
            unusable[name] = str(error).removeprefix(f"record {shown(path.name)}").lstrip(": ")
    if not found:
        raise first
    if TIME in names and TIME not in (column.name for column in found):  # a recorder's time axis comes with its channels
        found.insert(0, _column(TIME, max(own_time.values(), key=len), {TIME: time_unit}))
    return found, own_time, unusable


def _column(name: str, values: np.ndarray, units: dict[str, str]) -> Column:
    """A column with its unit."""
    return Column(name=name, unit=units.get(name) or brackets_of(name) or "", in_file=name in units, values=values)


def _time_column(columns: list[Column]) -> Column:
    """The column called time, or the first whose name says so, or the first that only grows; else a count of the samples."""
    called = [column for column in columns if column.name == TIME]
    called += [column for column in columns if means_time(column.name) and np.isfinite(column.values).any()]
    called += [column for column in columns if column.values.size > 1 and bool(np.all(np.diff(column.values) > 0.0))]
    longest = max((column.values.size for column in columns), default=0)
    return called[0] if called else Column(name="", unit="", in_file=False, values=np.arange(longest, dtype=np.float64))


def _time_unit(time: Column) -> tuple[str, str]:
    """The unit of the time stamps, and why it is a guess where the steps would be long for seconds."""
    stated = next((known for known in FACTORS[TIME] if time.unit and same_unit(time.unit, known, TIME)), None)
    if stated is not None:
        return stated, ""
    steps = np.diff(time.values[np.isfinite(time.values)])
    step = float(np.median(steps)) if steps.size else 0.0
    unit = next((one for one in ("s", "ms") if step * FACTORS[TIME][one] <= LONG_STEP), "us")
    statement = f"{time.unit!r} is no known unit of time" if time.unit else "the file states none"
    return unit, "" if unit == "s" else f"{statement}, and steps of {step:.4g} are long for s"


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two time axes of one length are the same."""
    if one is other or one.size < 2:
        return True
    return bool(np.nanmax(np.abs(one - other)) <= SAME_TIME * abs(float(np.nanmedian(np.diff(other)))))
