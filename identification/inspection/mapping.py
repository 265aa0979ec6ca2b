"""Which column is which channel, guessed from its name and unit."""

import re
import unicodedata
from dataclasses import dataclass, replace

import numpy as np

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.settings.scales import PAIRS, mistaken_unit, motion_ratio
from identification.experiment.units import FACTORS, STAND_INS, factor_to_si, output_of, same_unit
from identification.inspection.columns import Column

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
    "applied_force": ("appl", "drive", "excit", "shaker", "motor", "torque", "moment", "anreg", "aplicad"),
    "reaction_force": ("react", "support", "reac", "lager"),
}
SYMBOLS = {"x": "hammer_displacement", "y": "cart_displacement", "u": "relative_displacement", "f": "impact_force"}
AXIS = re.compile(r"^(.*\S)\s+[xyz]$")
ANGULAR = frozenset(("rad", "deg"))
TURNS = 4.0 * np.pi
"""rad: an angle that spans more is more likely written in degrees."""
TOO_FAR, LARGE_UNIT = 0.5, "mm"
"""m: a displacement that spans more is more likely written in this unit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mapped:
    """A column that serves as a channel.

    Attributes:
        channel: its name.
        column: the column.
        unit: of its numbers, known to the program: of what is measured, or of the sensor's output.
        guessed: why the unit is a guess; empty where it was stated.
        exact: whether the column bears the channel's name.
    """

    channel: str
    column: Column
    unit: str
    guessed: str
    exact: bool

    @property
    def factor(self) -> float:
        """SI value of one unit, of a sensor's output in V or A."""
        return factor_to_si(self.unit, self.dimension, self.channel)

    @property
    def is_output(self) -> bool:
        """Whether the numbers are a sensor's output, in volts or amperes."""
        return output_of(self.unit) is not None

    @property
    def dimension(self) -> str:
        """Of the unit."""
        return output_of(self.unit) or CHANNELS[self.channel]


def map_columns(columns: tuple[Column, ...]) -> tuple[Mapped, ...]:
    """Guess the channels of a file.

    Args:
        columns: all but the time.

    Returns:
        One entry for each channel that one column alone can be, in the order of `CHANNELS`.
    """
    exact = {column.name: column for column in columns if column.name in CHANNELS}
    guesses: dict[str, list[Column]] = {}
    for column in columns:
        channel = None if column.name in exact else _channel(column)
        if channel is not None and channel not in exact:
            guesses.setdefault(channel, []).append(column)
    for dimension in ("displacement", "acceleration"):  # of one body alone, it is the hammer
        channel, nameless = f"hammer_{dimension}", guesses.pop(f"_{dimension}", [])
        if dimension == "displacement" and any(_is_moment(column) for column in columns):
            channel = "relative_displacement"  # a moment turns a body, whose angle is relative
        if channel not in exact and "relative_displacement" not in (*exact, *guesses):
            guesses.setdefault(channel, nameless)
    alone = {channel: _most_moving(alike) for channel, alike in guesses.items()}
    chosen = exact | {channel: column for channel, column in alone.items() if column is not None}
    turned = any(_is_moment(column) for column in columns)
    found = [_mapped(channel, chosen[channel], turned=turned) for channel in CHANNELS if channel in chosen]
    large = next((one for one in found if one.guessed and one.unit == LARGE_UNIT), None)
    return tuple(replace(one, unit=large.unit, guessed=large.guessed) if large and _alike(one, large) else one for one in found)


def matched(time: np.ndarray, mapped: tuple[Mapped, ...]) -> tuple[Mapped, ...]:
    """Accelerations whose unit nothing states are in the one in which they agree with their displacement, if there is one.

    Args:
        time: s, shape (samples,).
        mapped: channels of one file.

    Returns:
        The same channels.
    """
    by_name = {one.channel: one for one in mapped}
    for displacement, acceleration in PAIRS:
        one, other = by_name.get(acceleration), by_name.get(displacement)
        if one is None or other is None or not one.guessed:
            continue
        ratio = motion_ratio(time, other.column.values * other.factor, one.column.values * one.factor)
        unit = mistaken_unit(acceleration, ratio, one.unit) if ratio is not None else ""
        if unit:
            by_name[acceleration] = replace(one, unit=unit, guessed=f"{one.guessed}, and in {unit} they agree with {displacement}")
    return tuple(by_name.values())


def is_angle(one: Mapped) -> bool:
    """Say whether a channel is an angle, by its name or unit.

    Args:
        one: a channel.

    Returns:
        Whether it is written in rad or deg.
    """
    return one.unit in ANGULAR


def _is_moment(column: Column) -> bool:
    """Whether a column's name says that it is a moment."""
    return any(word in _plain(column.name) for word in MOMENTS)


def _most_moving(alike: list[Column]) -> Column | None:
    """The one column that can be a channel; of a marker's three coordinates that in which it moves most. None where several can be."""
    markers = {found.group(1) for column in alike if (found := AXIS.match(_plain(column.name)))}
    if len(alike) > 1 and len(markers) == 1 and all(AXIS.match(_plain(column.name)) for column in alike):
        return max(alike, key=lambda column: float(np.nanstd(column.values)) if np.isfinite(column.values).any() else 0.0)
    return alike[0] if len(alike) == 1 else None


def _plain(name: str) -> str:
    """A name in lower case, without accents and without a unit behind it."""
    letters = unicodedata.normalize("NFKD", name.lower())
    bare = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return bare.partition("[")[0].partition("(")[0].strip(" _-")


def _alike(one: Mapped, other: Mapped) -> bool:
    """Whether nothing states the unit of one of two channels of a dimension: a file is written in one unit of length."""
    return bool(one.guessed) and CHANNELS[one.channel] == CHANNELS[other.channel]


def _channel(column: Column) -> str | None:
    """The channel that a column seems to be; its dimension alone, with "_" before it, where its body is not stated; else None."""
    bare = _plain(column.name)
    if bare in SYMBOLS:
        return SYMBOLS[bare]
    if column.unit in ANGULAR or any(word in bare for word in ANGLES):
        return "relative_displacement"
    known = [dimension for dimension in WORDS if column.unit not in STAND_INS and _known(column.unit, dimension)]
    dimension = known[0] if known else next((one for one, words in WORDS.items() if any(word in bare for word in words)), None)
    if dimension == "force":
        return next((channel for channel, words in FORCES.items() if any(word in bare for word in words)), "impact_force")
    if dimension is None:
        return None
    body = next((one for one, words in BODIES.items() if any(word in bare for word in words)), "")
    channel = f"{body}_{dimension}"
    return channel if not body or channel in CHANNELS else None


def _known(unit: str, dimension: str) -> bool:
    """Whether a text is a unit of a dimension."""
    return bool(unit) and any(same_unit(unit, known, dimension) for known in FACTORS[dimension])


def _mapped(channel: str, column: Column, *, turned: bool) -> Mapped:
    """Add the unit: that of the file if it is known, else a guess; `turned` where a moment beside it says that it is an angle."""
    dimension, guessed = CHANNELS[channel], ""
    if output_of(column.unit):
        return Mapped(channel=channel, column=column, unit=column.unit, guessed="", exact=column.name == channel)
    unit = next((known for known in FACTORS[dimension] if column.unit and same_unit(column.unit, known, dimension)), None)
    if unit is None:
        unit = si_unit(channel)
        guessed = f"{column.unit!r} is no known unit of {dimension}" if column.unit else "the file states none"
        usable = column.values[np.isfinite(column.values)]
        if channel == "relative_displacement" and (turned or any(word in _plain(column.name) for word in ANGLES)):
            many = usable.size and np.ptp(usable) > TURNS
            unit, reason = (
                ("deg", "the numbers are large for rad") if many else ("rad", "an angle by its name" if not turned else "a moment turns it")
            )
            return Mapped(channel=channel, column=column, unit=unit, guessed=f"{guessed}, and {reason}", exact=False)
        if dimension == "displacement" and usable.size and np.ptp(usable) > TOO_FAR:
            unit, guessed = LARGE_UNIT, f"{guessed}, and the numbers are large for m"
    return Mapped(channel=channel, column=column, unit=unit, guessed=guessed, exact=column.name == channel)
