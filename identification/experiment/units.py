"""Units that a record may be written in, and their factors to SI."""

import unicodedata
from math import pi

from identification.experiment.errors import ExperimentError, listed, shown

STANDARD_GRAVITY = 9.80665
POUND_FORCE = 4.4482216152605

# "V" serves electronic analogues, whose displacement and force are voltages: the volt then takes the place of the SI unit.
# "rad" and "deg" serve a pivot of length 1 m, whose arc in metres is its angle in radians.
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
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE, "V": 1.0},
}
SI_UNITS = {"displacement": "m", "time": "s", "acceleration": "m/s^2", "force": "N"}


def factor_to_si(unit: str, dimension: str, where: str) -> float:
    """Find the factor that turns numbers in `unit` into SI.

    Compatibility forms are one unit: the two micro signs, and "²" for "2".

    Args:
        unit: as written in the experiment file.
        dimension: "displacement", "time", "acceleration" or "force".
        where: the place in the experiment file, for the message.

    Returns:
        SI value of one `unit` (m, s, m/s^2 or N).

    Raises:
        ExperimentError: the unit is unknown or of another dimension; the message names the accepted ones.

    Example:
        >>> factor_to_si("mm", "displacement", "[sensors.hammer_displacement]")
        0.001
    """
    accepted = FACTORS[dimension]
    wanted = _canonical(unit)
    for name, factor in accepted.items():
        if _canonical(name) == wanted:
            return factor
    others = [other for other, table in FACTORS.items() if other != dimension and wanted in map(_canonical, table)]
    what = f"a unit of {others[0]}" if others else "not a known unit"
    raise ExperimentError(f"unit {shown(unit)} in {where} is {what}: expected one of {dimension}, that is {listed(accepted)}")


def _canonical(unit: str) -> str:
    """Fold compatibility characters, so that either micro sign and either exponent compare equal."""
    return unicodedata.normalize("NFKC", unit.strip())
