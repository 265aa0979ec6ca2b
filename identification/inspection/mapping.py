"""Which column is which channel, guessed from its name and unit."""

from dataclasses import dataclass, replace

import numpy as np

from identification.experiment.channels import CHANNELS, si_unit
from identification.experiment.settings.scales import PAIRS, mistaken_unit, motion_ratio
from identification.experiment.units import FACTORS, STAND_INS, factor_to_si, same_unit
from identification.inspection.columns import Column

WORDS = {
    "displacement": ("disp", "pos", "lvdt", "laser", "travel", "weg"),
    "acceleration": ("acc", "beschl"),
    "force": ("force", "load", "kraft", "fz"),
}
BODIES = {
    "relative": ("rel", "hammer-cart", "x-y"),
    "hammer": ("hammer", "impactor", "striker", "bob"),
    "cart": ("cart", "base", "table", "shaker", "carriage", "slide", "wagen"),
}
FORCES = {"applied_force": ("appl", "drive", "excit", "shaker", "motor"), "reaction_force": ("react", "support")}
SYMBOLS = {"x": "hammer_displacement", "y": "cart_displacement", "u": "relative_displacement", "f": "impact_force"}
TOO_FAR, LARGE_UNIT = 0.5, "mm"
"""m: a displacement that spans more is more likely written in this unit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mapped:
    """A column that serves as a channel.

    Attributes:
        channel: its name.
        column: the column.
        unit: of its numbers, known to the program.
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
        """SI value of one unit."""
        return factor_to_si(self.unit, CHANNELS[self.channel], self.channel)


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
    chosen = exact | {channel: alike[0] for channel, alike in guesses.items() if len(alike) == 1}
    found = [_mapped(channel, chosen[channel]) for channel in CHANNELS if channel in chosen]
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


def _alike(one: Mapped, other: Mapped) -> bool:
    """Whether nothing states the unit of one of two channels of a dimension: a file is written in one unit of length."""
    return bool(one.guessed) and CHANNELS[one.channel] == CHANNELS[other.channel]


def _channel(column: Column) -> str | None:
    """The channel that a column seems to be."""
    name = column.name.lower()
    bare = name.partition("[")[0].partition("(")[0].strip(" _-")
    if bare in SYMBOLS:
        return SYMBOLS[bare]
    known = [dimension for dimension in WORDS if column.unit not in STAND_INS and _known(column.unit, dimension)]
    dimension = known[0] if known else next((one for one, words in WORDS.items() if any(word in bare for word in words)), None)
    if dimension == "force":
        return next((channel for channel, words in FORCES.items() if any(word in bare for word in words)), "impact_force")
    body = next((one for one, words in BODIES.items() if any(word in bare for word in words)), None)
    channel = f"{body}_{dimension}"
    return channel if channel in CHANNELS else None


def _known(unit: str, dimension: str) -> bool:
    """Whether a text is a unit of a dimension."""
    return bool(unit) and any(same_unit(unit, known, dimension) for known in FACTORS[dimension])


def _mapped(channel: str, column: Column) -> Mapped:
    """Add the unit: that of the file if it is known, else a guess."""
    dimension, guessed = CHANNELS[channel], ""
    unit = next((known for known in FACTORS[dimension] if column.unit and same_unit(column.unit, known, dimension)), None)
    if unit is None:
        unit = si_unit(channel)
        guessed = f"{column.unit!r} is no known unit of {dimension}" if column.unit else "the file states none"
        usable = column.values[np.isfinite(column.values)]
        if dimension == "displacement" and usable.size and np.ptp(usable) > TOO_FAR:
            unit, guessed = LARGE_UNIT, f"{guessed}, and the numbers are large for m"
    return Mapped(channel=channel, column=column, unit=unit, guessed=guessed, exact=column.name == channel)
