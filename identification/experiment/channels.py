"""The channels a record may hold, the kinds of record, units and the sensitivities of sensors."""

import re
import unicodedata
from dataclasses import dataclass
from math import inf, pi

from scipy.constants import g as STANDARD_GRAVITY
from scipy.constants import pound_force as POUND_FORCE

from identification.experiment.errors import ExperimentError, listed, shown

# "V" serves electronic analogues, whose displacement and force are voltages: the volt then takes the place of the SI unit.
# "rad" and "deg" serve a pivot of length 1 m, whose arc in metres is its angle in radians.
STAND_INS = frozenset(("V", "rad", "deg"))
SELDOM = frozenset(("mil", "mg", "mm/s^2", "cm/s^2", "in/s^2", "ft/s^2", "kgf"))
"""Units that are too seldom to be taken for what somebody wrote by mistake."""
FACTORS: dict[str, dict[str, float]] = {
    "displacement": {
        "m": 1.0,
        "mm": 1e-3,
        "um": 1e-6,
        "µm": 1e-6,
        "cm": 1e-2,
        "in": 0.0254,
        "ft": 0.3048,
        "mil": 2.54e-5,
        "V": 1.0,
        "rad": 1.0,
        "deg": pi / 180.0,
    },
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "acceleration": {
        "m/s^2": 1.0,
        "m/s2": 1.0,
        "m/s²": 1.0,
        "g": STANDARD_GRAVITY,
        "gn": STANDARD_GRAVITY,
        "mg": 1e-3 * STANDARD_GRAVITY,
        "mm/s^2": 1e-3,
        "cm/s^2": 1e-2,
        "in/s^2": 0.0254,
        "ft/s^2": 0.3048,
    },
    "angle": {"rad": 1.0, "deg": pi / 180.0, "°": pi / 180.0},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE, "kgf": STANDARD_GRAVITY, "V": 1.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "rpm": 1.0 / 60.0, "rad/s": 0.5 / pi},
}
OUTPUTS: dict[str, dict[str, float]] = {
    "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6},
    "current": {"A": 1.0, "mA": 1e-3, "uA": 1e-6, "µA": 1e-6},
}
"""Of sensors, which a `Sensitivity` turns into what they measure."""
SI_UNITS = {"displacement": "m", "time": "s", "acceleration": "m/s^2", "angle": "rad", "force": "N", "frequency": "Hz"}

# Of columns that are no channel.
OTHERS = frozenset(("%", "°C", "K", "Pa", "kPa", "MPa", "bar", "kg", "Nm", "1", "um/m", "m/s", "mm/s"))
# As programs of National Instruments, oscilloscopes and makers of front ends write them out, in lower case.
ALIASES = {
    "meter": "m",
    "meters": "m",
    "millimeter": "mm",
    "millimeters": "mm",
    "micrometer": "um",
    "micrometers": "um",
    "micron": "um",
    "microns": "um",
    "inch": "in",
    "inches": "in",
    "feet": "ft",
    "mils": "mil",
    "thou": "mil",
    "volt": "V",
    "volts": "V",
    "millivolt": "mV",
    "millivolts": "mV",
    "ampere": "A",
    "amperes": "A",
    "degree": "deg",
    "degrees": "deg",
    "°": "deg",
    "radians": "rad",
    "newton": "N",
    "newtons": "N",
    "lb": "lbf",
    "lbs": "lbf",
    "pounds": "lbf",
    "kips": "kip",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "milliseconds": "ms",
    "usec": "us",
    "microseconds": "us",
    "g's": "g",
    "1/min": "rpm",
    "r/min": "rpm",
    "rev/min": "rpm",
    "m/sec^2": "m/s^2",
    "m/s**2": "m/s^2",
    "m/(s^2)": "m/s^2",
    "mm/s2": "mm/s^2",
    "cm/s2": "cm/s^2",
    "in/s2": "in/s^2",
    "ft/s2": "ft/s^2",
}


NEAR = 0.1
"""How near a ratio must come to that of two units; no calibration is so far off that it would be taken for one of them."""
_IN_NAME = re.compile(r"[\[({<]\s*([^\[\](){}<>]+?)\s*[\])}>]\s*$")
"""Brackets at the end of a column's name."""
_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]")
_BEHIND = re.compile(r"\S.*?(?P<mark>\s*/\s*|\s+in\s+|\s*,\s*|_|\s+)(?P<unit>[^\s_,/]+(?:/s\S*)?)\s*$")
"""A last word: "Weg / mm", "Weg in mm", "Laser, mm", "laser_mm", "Laser mm"."""
_WORDS = frozenset(("in", "min", "s", "V", "A"))
"""Units that as a last word more often mean something else, such as an input, a minimum or a phase."""


def factor_to_si(unit: str, dimension: str, where: str) -> float:
    """Find the factor that turns numbers in `unit` into SI.

    Compatibility forms are one unit: the two micro signs, "²" for "2", and the spellings of `ALIASES`.

    Args:
        unit: as written in the experiment file.
        dimension: "displacement", "time", "acceleration", "angle", "force" or "frequency"; "voltage" or "current" of a sensor's output.
        where: the place in the experiment file, for the message.

    Returns:
        SI value of one `unit` (m, s, m/s^2, rad, N, Hz, V or A).

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
    """Whether two texts mean one unit of a dimension; False also where one of them is no such unit.

    A stand-in for an SI unit, such as the volt, has its factor and is another unit all the same.

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
    """Whether a text without brackets is a unit, of a channel or of something else that recorders write beside it.

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


def unit_text(name: str) -> str | None:
    """What a column's name says of its unit: a unit in brackets, else any text in brackets at its end, else a last word that is a unit.

    A last word counts behind "/" or "in" if it is any unit of a channel or of a sensor's output; behind a comma, "_" or a blank it must
    not be one of `_WORDS` either.

    Example:
        >>> unit_text("LVDT 2 [mm]"), unit_text("Force (raw)"), unit_text("Weg / mm"), unit_text("v (m/s) Run #1"), unit_text("Force min")
        ('mm', 'raw', 'mm', 'm/s', None)
    """
    units = {_canonical(unit) for table in (FACTORS | OUTPUTS).values() for unit in table}
    at_end = _IN_NAME.search(name)
    if within := [unit for unit in _BRACKETS.findall(name) if is_unit(unit) and (unit not in ("A", "K", "1") or at_end)]:
        return within[-1]
    if at_end:
        return at_end.group(1)
    found = _BEHIND.fullmatch(name.strip())
    if found is None or not (found["mark"].strip() in ("/", "in") or found["unit"] not in _WORDS):
        return None
    return found["unit"] if _canonical(found["unit"]) in units else None


def unit_in_name(name: str, dimension: str) -> str | None:
    """The unit of a dimension, or of a sensor's output, in a column's name (`unit_text`); None where there is none.

    "A" is none: it numbers probes more often than it means amperes.

    Example:
        >>> unit_in_name("LVDT 2 [mm]", "displacement"), unit_in_name("LVDT 2 (mV)", "displacement"), unit_in_name("Probe (A)", "force")
        ('mm', 'mV', None)
    """
    text = unit_text(name)
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
    return ALIASES.get(folded.lower(), folded)


TIME = "time"
TIME_WORDS = frozenset(
    ("time", "zeit", "tempo", "temps", "tiempo", "timestamp", "timestamps", "seconds", "sekunden", "segundos", "uhrzeit")
)
TIME_SYMBOLS = frozenset(("t", "t s", "t ms", "t us", "x value", "zeitachse"))

# relative_displacement is u = x - y, for rigs that measure only the distance between hammer and cart.
# reaction_force is what suspension and stop resist with, positive against motion towards the stop, the hammer's inertia not included.
CHANNELS: dict[str, str] = {
    "hammer_displacement": "displacement",
    "cart_displacement": "displacement",
    "relative_displacement": "displacement",
    "hammer_acceleration": "acceleration",
    "cart_acceleration": "acceleration",
    "impact_force": "force",
    "applied_force": "force",
    "reaction_force": "force",
}
MOTION_CHANNELS = ("relative_displacement", "hammer_displacement")
CART_CHANNELS = ("cart_displacement", "cart_acceleration")
KINDS = ("drop-test", "cart-excitation", "free-decay", "forced", "prescribed")


def means_time(column: str) -> bool:
    """Whether a column's name says that it holds time stamps, in English, German or Portuguese.

    Example:
        >>> means_time("Zeit  1 - Messrate [s]"), means_time("t_ms"), means_time("Impact")
        (True, True, False)
    """
    bare = re.sub(r"[\W_\d]+", " ", re.split(r"[\[(]", column.lower())[0]).strip()
    return bare in TIME_SYMBOLS or not TIME_WORDS.isdisjoint(bare.split())


def is_time(column: str, unit: str | None) -> bool:
    """Whether a column holds time stamps, by its name or by its unit, which the file or the name states, or which is its name.

    Example:
        >>> is_time("Elapsed [ms]", None), is_time("X", "s"), is_time("ms", None), is_time("Index", None)
        (True, True, True, False)
    """
    stated = unit or unit_text(column) or column
    return means_time(column) or _canonical(stated) in map(_canonical, FACTORS["time"])


def si_unit(channel: str) -> str:
    """Name the SI unit of a channel.

    Args:
        channel: a key of `CHANNELS`.

    Returns:
        "m", "m/s^2" or "N".

    Example:
        >>> si_unit("impact_force")
        'N'
    """
    return SI_UNITS[CHANNELS[channel]]


_TEXT = re.compile(r"(?P<value>\d*\.?\d+(?:[eE][+-]?\d+)?)\s*(?P<output>[^\s\d./]+)\s*/\s*(?:\((?P<inner>.+)\)|(?P<plain>.+))")
"""Such as "10.2 mV/(m/s^2)"."""
_EXAMPLES = {"force": "11.2 mV/N", "acceleration": "100 mV/g", "displacement": "0.8 V/mm"}
"""By dimension."""
_SMALLEST = 1e-30
"""V or A for one SI unit; no sensor has less, nor more than its inverse."""


def example(dimension: str, output: str) -> str:
    """A sensitivity as one writes it, of a sensor with such an output.

    Example:
        >>> example("force", "mV"), example("displacement", "mA")
        ('11.2 mV/N', '0.8 mA/mm')
    """
    voltage = _EXAMPLES[dimension]
    return voltage if output_of(output) == "voltage" else re.sub(r"m?V", "mA", voltage)


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """Output of a sensor over what it measures, as its calibration sheet states it.

    Attributes:
        text: as written, for instance "11.2 mV/N".
        unit: of the output there, for instance "mV".
        per_si: output in V or A for one SI unit of what is measured, above 0.
    """

    text: str
    unit: str
    per_si: float

    def factor(self, unit: str, where: str) -> float:
        """SI value of what is measured at an output of one `unit`.

        Args:
            unit: of the recorded numbers.
            where: the place that states it, for the message.

        Raises:
            ExperimentError: it is no unit of the sensor's output.

        Example:
            >>> read_sensitivity("10 mV/N", "force", "[sensors.impact_force]").factor("V", "")
            100.0
        """
        kind = output_of(self.unit)
        if kind is None or output_of(unit) != kind:
            known = listed(OUTPUTS[kind] if kind else ())
            raise ExperimentError(
                f"unit {shown(unit)} in {where} does not suit the sensitivity of {self.text}: expected one of the sensor's output, that is "
                f"{known}; correct the unit, or take the sensitivity out where the numbers are what it measures"
            )
        return factor_to_si(unit, kind, where) / self.per_si


def read_sensitivity(text: str, dimension: str, where: str) -> Sensitivity:
    """Read a sensitivity.

    Args:
        text: a number, the unit of the output, "/" and a unit of what is measured: "11.2 mV/N", "10.2 mV/(m/s^2)".
        dimension: of what is measured.
        where: the table that states it, for the message.

    Raises:
        ExperimentError: the text is no such quotient, its number is not above 0, or a unit is unknown or of another dimension, such as the
            rated output of a bridge, in mV/V.

    Example:
        >>> read_sensitivity("0.8 V/mm", "displacement", "[sensors.hammer_displacement]").per_si
        800.0
    """
    found = _TEXT.fullmatch(text.strip())
    value, kind = (float(found["value"]), output_of(found["output"])) if found else (0.0, None)
    if found is None or kind is None or not 0.0 < value < inf:
        outputs = listed(unit for table in OUTPUTS.values() for unit in table)
        raise ExperimentError(
            f"sensitivity in {where} is {shown(text)}: expected a number above 0 with one of {outputs} over a unit of {dimension}; "
            f'write it as "{_EXAMPLES[dimension]}"'
        )
    measured = (found["inner"] or found["plain"]).strip()
    if output_of(measured):
        raise ExperimentError(
            f"sensitivity in {where} is {shown(text)}, a rated output over its supply: expected an output over a unit of {dimension}; "
            'multiply it by the supply and divide by the full scale, for 2 mV/V at 10 V and 500 N write "0.04 mV/N"'
        )
    per_si = value * factor_to_si(found["output"], kind, where) / factor_to_si(measured, dimension, f"the sensitivity of {where}")
    if not _SMALLEST < per_si < 1.0 / _SMALLEST:
        raise ExperimentError(f"sensitivity in {where} is {shown(text)}: expected one that a sensor can have; write it as on its sheet")
    return Sensitivity(text=text.strip(), unit=found["output"], per_si=per_si)


def mistaken_unit(channel: str, factor: float, declared: str | None) -> str:
    """The unit that the numbers would have to be in for a channel that reads `factor` times too much; empty where there is none."""
    if declared is None:
        return ""
    dimension = CHANNELS[channel]
    read = factor_to_si(declared, dimension, f"[sensors.{channel}]")
    others = {unit: true for unit, true in FACTORS[dimension].items() if true != read and unit not in STAND_INS | SELDOM}
    nearest = min(others, key=lambda unit: abs(factor * others[unit] / read - 1.0))
    return nearest if abs(factor * others[nearest] / read - 1.0) < NEAR else ""


_ANGLE = re.compile(r"atan2\(\s*(?P<minus1>-?)\s*(?P<across>[^,]+?)\s*,\s*(?P<minus2>-?)\s*(?P<along>[^,]+?)\s*\)")
"""Such as "atan2(x, -y)"."""


@dataclass(frozen=True)
class Angle:
    """An angle, rad, of a point seen from a pivot at the origin: the arctangent of two columns, each with its sign.

    Attributes:
        across, along: names of the columns: at right angles to the direction in which the angle is zero, and along it.
        signs: 1 or -1, of both.
    """

    across: str
    along: str
    signs: tuple[int, int]


def read_angle(text: str) -> Angle | None:
    """The angle that stands in place of a column's name; None for any other text.

    Example:
        >>> read_angle("atan2(x, -y)"), read_angle("x")
        (Angle(across='x', along='y', signs=(1, -1)), None)
    """
    found = _ANGLE.fullmatch(text.strip())
    if found is None:
        return None
    return Angle(found["across"], found["along"], (-1 if found["minus1"] else 1, -1 if found["minus2"] else 1))
