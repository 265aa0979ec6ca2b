"""Units that a record may be written in, and their factors to SI."""

import re
import unicodedata
from math import pi

from scipy.constants import g as STANDARD_GRAVITY
from scipy.constants import pound_force as POUND_FORCE

from identification.experiment.errors import ExperimentError, listed, shown

# "V" serves electronic analogues, whose displacement and force are voltages: the volt then takes the place of the SI unit.
# "rad" and "deg" serve a pivot of length 1 m, whose arc in metres is its angle in radians.
STAND_INS = frozenset(("V", "rad", "deg"))
FACTORS: dict[str, dict[str, float]] = {
    "displacement": {
        "m": 1.0,
        "mm": 1e-3,
        "um": 1e-6,
        "µm": 1e-6,
        "cm": 1e-2,
        "in": 0.0254,
        "ft": 0.3048,
        "V": 1.0,
        "rad": 1.0,
        "deg": pi / 180.0,
    },
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "acceleration": {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "g": STANDARD_GRAVITY, "gn": STANDARD_GRAVITY},
    "angle": {"rad": 1.0, "deg": pi / 180.0, "°": pi / 180.0},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE, "V": 1.0},
}
OUTPUTS: dict[str, dict[str, float]] = {
    "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6},
    "current": {"A": 1.0, "mA": 1e-3, "uA": 1e-6, "µA": 1e-6},
}
"""Of sensors, which a `Sensitivity` turns into what they measure."""
SI_UNITS = {"displacement": "m", "time": "s", "acceleration": "m/s^2", "angle": "rad", "force": "N"}

# Of columns that are no channel.
OTHERS = frozenset(("Hz", "kHz", "%", "°C", "K", "Pa", "kPa", "MPa", "bar", "kg", "Nm", "rpm", "1/min", "1", "um/m", "m/s", "mm/s"))
# As programs of National Instruments and makers of front ends write them out.
ALIASES = {
    "Meters": "m",
    "Inches": "in",
    "Feet": "ft",
    "Volts": "V",
    "Degrees": "deg",
    "°": "deg",
    "Radians": "rad",
    "Newtons": "N",
    "Newton": "N",
    "Pounds": "lbf",
    "sec": "s",
    "Seconds": "s",
    "m/sec^2": "m/s^2",
    "m/s**2": "m/s^2",
    "m/(s^2)": "m/s^2",
}


_IN_NAME = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
"""Brackets at the end of a column's name."""


def factor_to_si(unit: str, dimension: str, where: str) -> float:
    """Find the factor that turns numbers in `unit` into SI.

    Compatibility forms are one unit: the two micro signs, "²" for "2", and the spellings of `ALIASES`.

    Args:
        unit: as written in the experiment file.
        dimension: "displacement", "time", "acceleration", "angle" or "force"; "voltage" or "current" of a sensor's output.
        where: the place in the experiment file, for the message.

    Returns:
        SI value of one `unit` (m, s, m/s^2, rad, N, V or A).

    Raises:
        ExperimentError: the unit is unknown or of another dimension; the message names the accepted ones.

    Example:
        >>> factor_to_si("mm", "displacement", "[sensors.hammer_displacement]")
        0.001
    """
    accepted = (FACTORS | OUTPUTS)[dimension]
    wanted = _canonical(unit)
    for name, factor in accepted.items():
        if _canonical(name) == wanted:
            return factor
    others = [other for other, table in (OUTPUTS | FACTORS).items() if other != dimension and wanted in map(_canonical, table)]
    what = f"a unit of {others[0]}" if others else "not a known unit"
    remedy = "; where the numbers are a sensor's output, give its sensitivity, such as 11.2 mV/N" if output_of(unit) else ""
    raise ExperimentError(f"unit {shown(unit)} in {where} is {what}: expected one of {dimension}, that is {listed(accepted)}{remedy}")


def same_unit(unit: str, other: str, dimension: str) -> bool:
    """Say whether two texts mean one unit of a dimension.

    A stand-in for an SI unit, such as the volt, has its factor and is another unit all the same.

    Args:
        unit: any text.
        other: any text.
        dimension: as for `factor_to_si`.

    Returns:
        False also where one of them is no unit of that dimension.

    Example:
        >>> same_unit("m/s2", "m/s^2", "acceleration"), same_unit("V", "m", "displacement")
        (True, False)
    """
    factors = {_canonical(name): factor for name, factor in (FACTORS | OUTPUTS)[dimension].items()}
    one, two = _canonical(unit), _canonical(other)
    if not {one, two} <= factors.keys():
        return False
    return one == two or (factors[one] == factors[two] and not STAND_INS & {one, two})


def is_unit(text: str) -> bool:
    """Say whether a text is a unit, of a channel or of something else that recorders write beside it.

    Args:
        text: without brackets.

    Returns:
        Whether it is known.

    Example:
        >>> is_unit("mm"), is_unit("°C"), is_unit("Force")
        (True, True, False)
    """
    return _canonical(text) in {_canonical(unit) for table in (FACTORS | OUTPUTS).values() for unit in table} | OTHERS


def output_of(unit: str) -> str | None:
    """What a sensor gives out in this unit, "voltage" or "current"; None for any other text.

    Example:
        >>> output_of("mV"), output_of("N")
        ('voltage', None)
    """
    return next((kind for kind, table in OUTPUTS.items() if _canonical(unit) in map(_canonical, table)), None)


def brackets_of(name: str) -> str | None:
    """What stands in brackets at the end of a column's name, a unit or not; None without brackets.

    Example:
        >>> brackets_of("LVDT 2 [mm]"), brackets_of("Force (raw)"), brackets_of("Force")
        ('mm', 'raw', None)
    """
    found = _IN_NAME.search(name)
    return found.group(1) if found else None


def unit_in_name(name: str, dimension: str) -> str | None:
    """The unit of a dimension, or of a sensor's output, in brackets at the end of a column's name; None where there is none.

    "A" is none: it numbers probes more often than it means amperes.

    Example:
        >>> unit_in_name("LVDT 2 [mm]", "displacement"), unit_in_name("LVDT 2 (mV)", "displacement"), unit_in_name("Probe (A)", "force")
        ('mm', 'mV', None)
    """
    text = brackets_of(name)
    if text is None or _canonical(text) == "A":
        return None
    is_output = dimension != "time" and output_of(text) is not None
    return text if is_output or _canonical(text) in map(_canonical, FACTORS[dimension]) else None


def is_stand_in(unit: str | None) -> bool:
    """Whether a text, however spelt, is a stand-in for an SI unit, such as the volt."""
    return unit is not None and _canonical(unit) in STAND_INS


def _canonical(unit: str) -> str:
    """Fold compatibility characters and spellings, so that either micro sign, either exponent and "Newtons" for "N" compare equal."""
    folded = unicodedata.normalize("NFKC", unit.strip())
    return ALIASES.get(folded, folded)
