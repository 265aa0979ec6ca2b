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
_DEGREE, _FOOT, _INCH = pi / 180.0, 0.3048, 0.0254
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "in": _INCH, "ft": _FOOT, "mil": 1e-3 * _INCH}
_GRAVITIES = {"g": STANDARD_GRAVITY, "gn": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY}
FACTORS: dict[str, dict[str, float]] = {
    "displacement": {**_LENGTHS, "V": 1.0, "rad": 1.0, "deg": _DEGREE},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "acceleration": {"m/s^2": 1.0, **_GRAVITIES, "mm/s^2": 1e-3, "cm/s^2": 1e-2, "in/s^2": _INCH, "ft/s^2": _FOOT},
    "angle": {"rad": 1.0, "deg": _DEGREE},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE, "kgf": STANDARD_GRAVITY, "V": 1.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "rpm": 1.0 / 60.0, "rad/s": 0.5 / pi},
}
OUTPUTS: dict[str, dict[str, float]] = {"voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6}, "current": {"A": 1.0, "mA": 1e-3, "uA": 1e-6}}
"""Of sensors, which a `Sensitivity` turns into what they measure."""
SI_UNITS = {"displacement": "m", "time": "s", "acceleration": "m/s^2", "angle": "rad", "force": "N", "frequency": "Hz"}
_UNITS = FACTORS | OUTPUTS
_EVERY_UNIT = frozenset(unit for table in _UNITS.values() for unit in table)

# Of columns that are no channel.
OTHERS = frozenset(("%", "°C", "K", "Pa", "kPa", "MPa", "bar", "kg", "Nm", "1", "um/m", "m/s", "mm/s"))
# As programs of National Instruments, oscilloscopes and makers of front ends write them out, in lower case.
_SPELLINGS = {
    "m": ("meter", "meters"),
    "mm": ("millimeter", "millimeters"),
    "um": ("micrometer", "micrometers", "micron", "microns"),
    "in": ("inch", "inches"),
    "ft": ("feet",),
    "mil": ("mils", "thou"),
    "V": ("volt", "volts"),
    "mV": ("millivolt", "millivolts"),
    "A": ("ampere", "amperes"),
    "deg": ("degree", "degrees", "°"),
    "rad": ("radians",),
    "N": ("newton", "newtons"),
    "lbf": ("lb", "lbs", "pounds"),
    "kip": ("kips",),
    "s": ("sec", "second", "seconds"),
    "ms": ("msec", "milliseconds"),
    "us": ("usec", "microseconds"),
    "g": ("g's",),
    "rpm": ("1/min", "r/min", "rev/min"),
    "m/s^2": ("m/s2", "m/sec^2", "m/s**2", "m/(s^2)"),
    "mm/s^2": ("mm/s2",),
    "cm/s^2": ("cm/s2",),
    "in/s^2": ("in/s2",),
    "ft/s^2": ("ft/s2",),
}
_SPELT = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings}


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

    Compatibility forms are one unit: the two micro signs and "u", "²" for "^2", and the spellings of `_SPELLINGS`. The dimension is one of
    `FACTORS`, or "voltage" or "current" of a sensor's output; `where` is the place in the experiment file, for the message.

    Raises:
        ExperimentError: the unit is unknown or of another dimension; the message names the accepted ones.

    Example:
        >>> factor_to_si("mm", "displacement", "[sensors.hammer_displacement]")
        0.001
    """
    accepted, wanted = _UNITS[dimension], _canonical(unit)
    if wanted in accepted:
        return accepted[wanted]
    others = [other for other, table in (OUTPUTS | FACTORS).items() if wanted in table]
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
    factors, one, two = _UNITS[dimension], _canonical(unit), _canonical(other)
    if not {one, two} <= factors.keys():
        return False
    return one == two or (factors[one] == factors[two] and not STAND_INS & {one, two})


def unit_among(text: str, dimension: str) -> str | None:
    """The first unit of a dimension that a text means (`same_unit`); None where it means none.

    Example:
        >>> unit_among("Newtons", "force"), unit_among("lbs", "displacement")
        ('N', None)
    """
    return next((unit for unit in FACTORS[dimension] if same_unit(text, unit, dimension)), None)


def is_unit(text: str) -> bool:
    """Whether a text without brackets is a unit, of a channel or of something else that recorders write beside it.

    Example:
        >>> is_unit("mm"), is_unit("°C"), is_unit("Force")
        (True, True, False)
    """
    return _canonical(text) in _EVERY_UNIT | OTHERS


def output_of(unit: str) -> str | None:
    """What a sensor gives out in this unit, "voltage" or "current"; None for any other text.

    Example:
        >>> output_of("mV"), output_of("N")
        ('voltage', None)
    """
    return next((kind for kind, table in OUTPUTS.items() if _canonical(unit) in table), None)


def unit_text(name: str) -> str | None:
    """What a column's name says of its unit: a unit in brackets, else any text in brackets at its end, else a last word that is a unit.

    A last word counts behind "/" or "in" if it is any unit of a channel or of a sensor's output; behind a comma, "_" or a blank it must
    not be one of `_WORDS` either.

    Example:
        >>> unit_text("LVDT 2 [mm]"), unit_text("Force (raw)"), unit_text("Weg / mm"), unit_text("v (m/s) Run #1"), unit_text("Force min")
        ('mm', 'raw', 'mm', 'm/s', None)
    """
    at_end = _IN_NAME.search(name)
    if within := [unit for unit in _BRACKETS.findall(name) if is_unit(unit) and (unit not in ("A", "K", "1") or at_end)]:
        return within[-1]
    if at_end:
        return at_end.group(1)
    found = _BEHIND.fullmatch(name.strip())
    if found is None or not (found["mark"].strip() in ("/", "in") or found["unit"] not in _WORDS):
        return None
    return found["unit"] if _canonical(found["unit"]) in _EVERY_UNIT else None


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
    return text if is_output or _canonical(text) in FACTORS[dimension] else None


def is_stand_in(unit: str | None) -> bool:
    """Whether a text, however spelt, is a stand-in for an SI unit, such as the volt."""
    return unit is not None and _canonical(unit) in STAND_INS


def _canonical(unit: str) -> str:
    """A unit as the tables have it: compatibility characters and spellings folded, such as either micro sign, and "Newtons" for "N"."""
    folded = unicodedata.normalize("NFKC", unit.strip()).replace("\u03bc", "u")
    return _SPELT.get(folded.lower(), folded)


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
AT_REST, STRUCK = ("drop-test", "free-decay"), ("drop-test", "cart-excitation")
"""Kinds in which the cart rests, unless its motion was measured; those in which the hammer strikes from free flight."""
KINDS = ("drop-test", "cart-excitation", "free-decay", "forced", "prescribed")


def is_time(column: str, unit: str | None) -> bool:
    """Whether a column holds time stamps, by its name or by its unit, which the file or the name states, or which is its name.

    Example:
        >>> is_time("Zeit  1 - Messrate", None), is_time("Elapsed [ms]", None), is_time("X", "s"), is_time("Index", None)
        (True, True, True, False)
    """
    bare = re.sub(r"[\W_\d]+", " ", re.split(r"[\[(]", column.lower())[0]).strip()
    said = bare in TIME_SYMBOLS or not TIME_WORDS.isdisjoint(bare.split())
    return said or _canonical(unit or unit_text(column) or column) in FACTORS["time"]


def si_unit(channel: str) -> str:
    """Name the SI unit of a channel, a key of `CHANNELS`: "m", "m/s^2" or "N".

    Example:
        >>> si_unit("impact_force")
        'N'
    """
    return SI_UNITS[CHANNELS[channel]]


_TEXT = re.compile(r"(?P<value>\d*\.?\d+(?:[eE][+-]?\d+)?)\s*(?P<output>[^\s\d./]+)\s*/\s*(?:\((?P<inner>.+)\)|(?P<plain>.+))")
_EXAMPLES = {"force": "11.2 mV/N", "acceleration": "100 mV/g", "displacement": "0.8 V/mm"}
"""By dimension."""


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
        """SI value of what is measured at an output of one `unit`, that of the recorded numbers, which `where` states.

        Raises:
            ExperimentError: it is no unit of the sensor's output.

        Example:
            >>> read_sensitivity("10 mV/N", "force", "[sensors.impact_force]").factor("V", "")
            100.0
        """
        kind = output_of(self.unit) or "voltage"
        if output_of(unit) != kind:
            known = listed(OUTPUTS[kind])
            raise ExperimentError(
                f"unit {shown(unit)} in {where} does not suit the sensitivity of {self.text}: expected one of the sensor's output, that is "
                f"{known}; correct the unit, or take the sensitivity out where the numbers are what it measures"
            )
        return factor_to_si(unit, kind, where) / self.per_si


def read_sensitivity(text: str, dimension: str, where: str) -> Sensitivity:
    """Read a sensitivity: a number, the unit of the output, "/" and a unit of the dimension that is measured, as in "10.2 mV/(m/s^2)".

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
    if not 1e-30 < per_si < 1e30:  # V or A for one SI unit
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
