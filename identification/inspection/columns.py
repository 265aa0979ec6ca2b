"""All columns of a file, read leniently, and which of them seem to be channels: what cannot be used is named with its reason."""

import re
import unicodedata
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import (
    CHANNELS,
    STAND_INS,
    TIME,
    factor_to_si,
    is_time,
    is_unit,
    mistaken_unit,
    output_of,
    si_unit,
    unit_among,
    unit_text,
)
from identification.experiment.clock import ClockSettings, all_repeat, check_time, steps_back, stretches, timed
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.load_record import angle_of
from identification.experiment.noise import estimate_noise
from identification.experiment.readers import Lost, read_columns
from identification.experiment.readers.apart import TooCostlyError
from identification.experiment.readers.recorder import same_axis
from identification.experiment.samples import Saturation, find_saturation
from identification.experiment.signals import ONE_BODY, motion_ratio


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

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest value; NaN where none is usable."""
        usable = self.values[np.isfinite(self.values)]
        return (float(usable.min()), float(usable.max())) if usable.size else (np.nan, np.nan)

    @cached_property
    def noise(self) -> float | None:
        """Standard deviation, estimated as for a fit; None where it cannot be estimated."""
        return estimate_noise(self.values)

    @cached_property
    def saturation(self) -> tuple[Saturation, ...]:
        """Levels at which it is cut off."""
        return find_saturation(self.values)


@dataclass(frozen=True, kw_only=True, eq=False)
class FileColumns:
    """What one file holds.

    Attributes:
        file: its name.
        time: the column of time stamps; where the file has none, one without name that counts the samples.
        time_unit: of these stamps.
        time_guessed: why the unit is a guess; empty where it was stated, or steps are short enough for s as it is without a statement.
        columns: the others on the same time axis.
        unusable: why a column cannot be used, by name.
        notices: sentences on what had to be concluded in reading.
        clock: what the record has to declare of its time stamps.
    """

    file: str
    time: Column
    time_unit: str
    time_guessed: str
    columns: tuple[Column, ...]
    unusable: dict[str, str] = field(default_factory=dict)
    notices: tuple[str, ...] = ()
    clock: ClockSettings = ClockSettings()

    @property
    def untimed(self) -> bool:
        """Whether the file has no time stamps: its times are then numbers of samples."""
        return not self.time.name

    @property
    def time_factor(self) -> float:
        """Seconds per unit of the time stamps."""
        return factor_to_si(self.time_unit, TIME, self.file)

    @cached_property
    def seconds(self) -> Float64[np.ndarray, " samples"]:
        """Time stamps in s."""
        return self.time.values * self.time_factor

    @cached_property
    def rate(self) -> float:
        """Samples a second, by the median step, Hz; NaN where there are fewer than two or most are repeated."""
        steps = np.diff(self.seconds[np.isfinite(self.seconds)])
        return 1.0 / float(np.median(steps)) if steps.size and np.median(steps) > 0.0 else np.nan

    @cached_property
    def problem(self) -> str:
        """Why a record with these time stamps would be refused; empty where it would not."""
        try:
            check_time(self.seconds, "the record")
        except ExperimentError as error:
            return str(error)
        return ""


def read_file(path: Path) -> FileColumns:
    """Read a file of any known format.

    Raises:
        ExperimentError: it cannot be read, or holds nothing beside time stamps.
    """
    names = read_columns(path, frozenset(), path.name).names
    found, own_time, unusable, notices, lost = _read_all(path, names)
    time = _time_column(found)
    written = time.values
    unit, guessed = _time_unit(time) if time.name else ("s", "")
    columns = []
    for column in found:
        own = own_time.get(column.name, written)
        if column.name == time.name:
            continue
        if _is_count(column):
            unusable[column.name] = "it numbers the samples"
        elif column.values.size != time.values.size or not same_axis(written, own):
            unusable[column.name] = f"{column.values.size} samples on another time axis: resample it to that of the others and export again"
        else:
            columns.append(column)
    if not columns:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in unusable.items())[:200] or "there is none"
        raise ExperimentError(
            f"{shown(path.name)} has no usable column beside the time ({reasons}): expected at least one; export it again"
        )
    factor = factor_to_si(unit, TIME, path.name)
    notices += tuple(one.sentence(written * factor if time.name else None) for one in lost if one.column not in unusable)
    seconds, columns, said, clock = _clocked(written * factor, _with_angle(columns))
    return FileColumns(
        file=path.name,
        time=replace(time, values=seconds / factor),
        time_unit=unit,
        time_guessed=guessed,
        columns=tuple(columns),
        unusable=unusable,
        notices=(*notices, *said),
        clock=clock,
    )


def _clocked(time: np.ndarray, columns: list[Column]) -> tuple[np.ndarray, list[Column], tuple[str, ...], ClockSettings]:
    """Time, s, and columns of the samples that are used, notices, and what the record has to declare for that.

    Of a clock that steps back it is the longest stretch; stamps that are repeated, and not for want of digits alone, are rebuilt evenly.
    """
    values, settings = {column.name: column.values for column in columns}, ClockSettings()
    if steps_back(time):
        settings = ClockSettings(stretch=1 + int(np.argmax([part.stop - part.start for part in stretches(time)])))
    even, kept, said = timed(time, values, settings, None, "the record")
    steps = np.diff(even)
    if (steps == 0.0).any() and not all_repeat(steps, kept.values()):
        with suppress(ExperimentError):
            even, kept, said = timed(time, values, replace(settings, rebuild=True), None, "the record")
            settings = replace(settings, rebuild=True)
    return even, [replace(column, values=kept[column.name]) for column in columns], said, settings


def _with_angle(columns: list[Column]) -> list[Column]:
    """With the angle of a point whose coordinates are x and y, where it moves on a circle about the origin, in place of both."""
    x, y = (next((column for column in columns if _plain(column.name) == name), None) for name in "xy")
    if x is None or y is None:
        return columns
    radius = np.hypot(x.values, y.values)
    if not np.isfinite(radius).any() or np.nanstd(radius) > 0.05 * np.nanmean(radius):  # not on a circle
        return columns
    down = "-" if np.nanmean(y.values) < 0.0 else ""
    angle = angle_of(x.values, -y.values if down else y.values)
    if np.nanmax(angle) - np.nanmin(angle) < 1e-3:  # rad
        return columns
    name = f"atan2({x.name}, {down}{y.name})"
    return [*(one for one in columns if one not in (x, y)), Column(name=name, unit="rad", in_file=True, values=angle)]


def _read_all(
    path: Path, names: tuple[str, ...]
) -> tuple[list[Column], dict[str, np.ndarray], dict[str, str], tuple[str, ...], tuple[Lost, ...]]:
    """All columns at once; where that fails, each with its own time axis, so that one bad column spoils no other; notices, lost samples."""
    try:
        everything = read_columns(path, frozenset(names), path.name)
        found = [_column(name, everything.values[name], everything.units) for name in names if name in everything.values]
        return found, {}, {}, everything.notices, everything.lost
    except TooCostlyError:
        raise
    except ExperimentError as error:
        first = error
    found, own_time, unusable, time_unit, notices, lost = [], {}, {}, "s", {}, []
    for name in names:
        try:
            one = read_columns(path, frozenset({name, TIME}), path.name)
            own_time |= {name: one.values[TIME]} if TIME in one.values else {}
            time_unit = one.units.get(TIME, time_unit)
            found += [_column(name, one.values[name], one.units)] if name in one.values else []
            notices |= dict.fromkeys(one.notices)
            lost += [each for each in one.lost if each.column == name]
        except ExperimentError as error:
            unusable[name] = str(error).removeprefix(f"record {shown(path.name)}").lstrip(": ")
    if not found:
        raise first
    if TIME in names and TIME not in (column.name for column in found):  # a recorder's time axis comes with its channels
        found.insert(0, _column(TIME, max(own_time.values(), key=len), {TIME: time_unit}))
    return found, own_time, unusable, tuple(notices), tuple(lost)


def _column(name: str, values: np.ndarray, units: dict[str, str]) -> Column:
    """A column with its unit."""
    return Column(name=name, unit=units.get(name) or unit_text(name) or "", in_file=name in units, values=values)


def _time_column(columns: list[Column]) -> Column:
    """The column called time, or the first whose name says so, or the first that grows, even if it steps back; else a count of samples."""
    called = [column for column in columns if column.name == TIME]
    called += [column for column in columns if is_time(column.name, column.unit or None) and np.isfinite(column.values).any()]
    grows = [column for column in columns if column.values.size > 1 and np.mean(np.diff(column.values) > 0.0) > 0.99]
    called += [column for column in grows if not _is_count(column)]
    longest = max((column.values.size for column in columns), default=0)
    return called[0] if called else Column(name="", unit="", in_file=False, values=np.arange(longest, dtype=np.float64))


def _is_count(column: Column) -> bool:
    """Whether a column numbers the samples, from 0 or 1, and neither its name nor its unit says that it is something else."""
    size = column.values.size
    if column.name in CHANNELS or is_time(column.name, column.unit or None) or is_unit(column.unit):
        return False
    return size > 1 and bool(np.array_equal(column.values, np.arange(size) + float(column.values[0] == 1.0)))


def _time_unit(time: Column) -> tuple[str, str]:
    """The unit of the time stamps, and why it is a guess: without a statement s, but whole numbers count ms or us.

    A long step is more likely in a smaller unit, as counted by a controller or an oscilloscope; beyond 0.05 s the guess is asked about.
    """
    if (stated := unit_among(time.unit, TIME)) is not None:
        return stated, ""
    stamps = time.values[np.isfinite(time.values)]
    steps = np.diff(stamps)
    step = 0.0 if not steps.size else float(np.median(steps) if steps.all() else (stamps[-1] - stamps[0]) / steps.size)
    slow = step > 0.05
    whole = slow and bool(np.array_equal(stamps, np.rint(stamps)))
    unit = next((one for one, longest in (("s", 10.0), ("ms", 200.0)) if step <= longest and not (whole and one == "s")), "us")
    statement = f"{time.unit!r} is no known unit of time" if time.unit else "the file states none"
    return unit, f"{statement}, and {'whole' if whole else 'the'} numbers come in steps of {step:.4g}" if slow else ""


# Parts of names in English, German and Portuguese, in lower case and without accents.
WORDS = {
    "acceleration": ("acc", "beschl", "acel"),
    "force": ("force", "load", "kraft", "forc", "celula", "fz", "torque", "moment"),
    "displacement": ("disp", "pos", "lvdt", "laser", "travel", "weg", "auslenk", "abstand", "desloc", "curso", "distanc", "encoder"),
}
MOMENTS = ("torque", "moment")
ANGLES = ("angle", "angul", "winkel", "theta", "phi")
BODIES = {
    "relative": ("rel", "hammer-cart", "x-y"),
    "hammer": ("hammer", "impactor", "impaktor", "striker", "bob", "martel", "pend"),
    "cart": ("cart", "base", "basis", "table", "tisch", "shaker", "carriage", "slide", "wagen", "schlitten", "carr", "mesa"),
}
FORCES = {
    "applied_force": ("appl", "drive", "excit", "shaker", "sting", "motor", "torque", "moment", "anreg", "erreg", "aplicad"),
    "reaction_force": ("react", "support", "reac", "lager"),
}
SYMBOLS = {"x": "hammer_displacement", "y": "cart_displacement", "u": "relative_displacement", "f": "impact_force"}
ANGULAR = frozenset(("rad", "deg"))
LARGE_UNIT = "mm"
"""Of displacements that span more than half a metre if they are in m."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mapped:
    """A column that serves as a channel.

    Attributes:
        channel: its name.
        column: the column.
        unit: of its numbers, known to the program: of what is measured, or of the sensor's output.
        guessed: why the unit is a guess; empty where it was stated.
        unknown: whether the file states a unit that is not known, or nothing at all of its only column, so that the unit here is only a
            placeholder.
    """

    channel: str
    column: Column
    unit: str
    guessed: str
    unknown: bool = False

    @property
    def exact(self) -> bool:
        """Whether the column bears the channel's name."""
        return self.column.name == self.channel

    @property
    def factor(self) -> float:
        """SI value of one unit, of a sensor's output in V or A."""
        return factor_to_si(self.unit, self.dimension, self.channel)

    @property
    def zero(self) -> float | None:
        """How uncertain the zero is of a motion that swings twice about a mean far from 0, in the file's unit; else None."""
        usable = self.column.values[np.isfinite(self.column.values)]
        if CHANNELS[self.channel] == "force" or not usable.size:
            return None
        mean, swing = np.mean(usable), np.std(usable)
        swings = np.count_nonzero(np.diff(usable > mean)) >= 4
        return float(swing) if swings and abs(mean) > 0.5 * swing else None

    @property
    def is_output(self) -> bool:
        """Whether the numbers are a sensor's output, in volts or amperes."""
        return output_of(self.unit) is not None

    @property
    def dimension(self) -> str:
        """Of the unit."""
        return output_of(self.unit) or CHANNELS[self.channel]


def map_columns(columns: tuple[Column, ...]) -> tuple[Mapped, ...]:
    """Guess the channels of a file: one entry for each channel that one column alone can be, in the order of `CHANNELS`."""
    exact = {column.name: column for column in columns if column.name in CHANNELS}
    turned = any(_says(column.name, MOMENTS) for column in columns)  # a moment turns a body, whose angle is relative
    guesses: dict[str, list[Column]] = {}
    for column in columns:
        channel = None if column.name in exact else _channel(column)
        if channel is not None and channel not in exact:
            guesses.setdefault(channel, []).append(column)
    for dimension in ("displacement", "acceleration"):  # of one body alone, it is the hammer
        channel, nameless = f"hammer_{dimension}", guesses.pop(f"_{dimension}", [])
        if dimension == "displacement" and turned:
            channel = "relative_displacement"
        if channel not in exact and "relative_displacement" not in (*exact, *guesses):
            guesses.setdefault(channel, nameless)
    alone = {channel: _most_moving(alike) for channel, alike in guesses.items()}
    chosen = exact | {channel: column for channel, column in alone.items() if column is not None}
    found = [_mapped(channel, chosen[channel], turned=turned) for channel in CHANNELS if channel in chosen]
    if not found and len(columns) == 1 and (not columns[0].unit or output_of(columns[0].unit)):  # what else would have been recorded
        only = _mapped("hammer_displacement", columns[0], turned=False)
        return (replace(only, unknown=not only.is_output),)
    large = next((one for one in found if one.guessed and one.unit == LARGE_UNIT), None)
    if large is None:
        return tuple(found)
    alike = [bool(one.guessed) and CHANNELS[one.channel] == CHANNELS[large.channel] for one in found]  # a file has one unit of length
    return tuple(replace(one, unit=large.unit, guessed=large.guessed) if same else one for one, same in zip(found, alike, strict=True))


def matched(time: np.ndarray, mapped: tuple[Mapped, ...]) -> tuple[Mapped, ...]:
    """Accelerations whose unit nothing states are in the one in which they agree with their displacement, if there is one."""
    by_name = {one.channel: one for one in mapped}
    for displacement, acceleration in ONE_BODY:
        one, other = by_name.get(acceleration), by_name.get(displacement)
        if one is None or other is None or not one.guessed:
            continue
        ratio = motion_ratio(time, other.column.values * other.factor, one.column.values * one.factor)
        unit = mistaken_unit(acceleration, ratio, one.unit) if ratio is not None else ""
        if unit:
            by_name[acceleration] = replace(one, unit=unit, guessed=f"{one.guessed}, and in {unit} they agree with {displacement}")
    return tuple(by_name.values())


def _most_moving(alike: list[Column]) -> Column | None:
    """The one column that can be a channel; of a marker's three coordinates that in which it moves most. None where several can be."""
    markers = [found.group(1) for column in alike if (found := re.match(r"(.*\S)\s+[xyz]$", _plain(column.name)))]
    if len(alike) == len(markers) > 1 and len(set(markers)) == 1:
        return max(alike, key=lambda column: float(np.nanstd(column.values)) if np.isfinite(column.values).any() else 0.0)
    return alike[0] if len(alike) == 1 else None


def _plain(name: str) -> str:
    """A name in lower case, without accents and without a unit behind it."""
    letters = unicodedata.normalize("NFKD", name.lower())
    bare = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return bare.partition("[")[0].partition("(")[0].strip(" _-")


def _says(name: str, words: tuple[str, ...]) -> bool:
    """Whether a column's name holds one of some words."""
    return any(word in _plain(name) for word in words)


def _first_said(name: str, table: dict[str, tuple[str, ...]]) -> str | None:
    """The first entry of a table whose word a column's name contains."""
    return next((entry for entry, words in table.items() if _says(name, words)), None)


def _channel(column: Column) -> str | None:
    """The channel that a column seems to be; its dimension alone, with "_" before it, where its body is not stated; else None."""
    name, bare = column.name, _plain(column.name)
    symbol = bare.removesuffix(_plain(column.unit)).rstrip(" _-/,") if column.unit else bare
    if bare in SYMBOLS or (symbol in SYMBOLS and unit_among(column.unit, CHANNELS[SYMBOLS[symbol]])):
        return SYMBOLS[symbol]
    if column.unit in ANGULAR or _says(name, ANGLES):
        return "relative_displacement"
    known = [dimension for dimension in WORDS if column.unit not in STAND_INS and unit_among(column.unit, dimension)]
    dimension = known[0] if known else _first_said(name, WORDS)
    if dimension == "force":
        return _first_said(name, FORCES) or "impact_force"
    if dimension is None:
        return None
    body = _first_said(name, BODIES) or ""
    channel = f"{body}_{dimension}"
    return channel if not body or channel in CHANNELS else None


def _mapped(channel: str, column: Column, *, turned: bool) -> Mapped:
    """Add the unit: that of the file if it is known, else a guess; `turned` where a moment beside it says that it is an angle."""
    dimension = CHANNELS[channel]
    unit = column.unit if output_of(column.unit) else unit_among(column.unit, dimension)
    if unit is not None:
        return Mapped(channel=channel, column=column, unit=unit, guessed="")
    unit, guessed = si_unit(channel), f"{column.unit!r} is no known unit of {dimension}" if column.unit else "the file states none"
    low, high = column.limits
    if channel == "relative_displacement" and (turned or _says(column.name, ANGLES)):
        unit, reason = ("rad", "a moment turns it" if turned else "an angle by its name")
        if high - low > 4.0 * np.pi:
            unit, reason = "deg", "the numbers are large for rad"
        return Mapped(channel=channel, column=column, unit=unit, guessed=f"{guessed}, and {reason}")
    if dimension == "displacement" and high - low > 0.5:
        unit, guessed = LARGE_UNIT, f"{guessed}, and the numbers are large for m"
    unknown = bool(column.unit) and not _says(column.name, MOMENTS)
    return Mapped(channel=channel, column=column, unit=unit, guessed=guessed, unknown=unknown)
