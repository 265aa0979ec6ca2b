"""How channels and coordinates are written in figures and tables: words, the thesis's symbol, and a unit that suits the size."""

import dataclasses
import math

from identification.experiment import CHANNELS, Experiment, si_unit
from identification.experiment.units import factor_to_si
from identification.wording.numbers import unit_text


@dataclasses.dataclass(frozen=True, kw_only=True)
class Label:
    """How one channel or coordinate is drawn: values in SI times `factor` are in `unit`."""

    words: str
    symbol: str
    factor: float
    unit: str

    @property
    def axis(self) -> str:
        """Text of an axis."""
        return f"{self.symbol} ({unit_text(self.unit)})"


_WORDS = {
    "hammer_displacement": ("hammer displacement", "x"),
    "cart_displacement": ("cart displacement", "y"),
    "relative_displacement": ("relative displacement", "u"),
    "hammer_acceleration": ("hammer acceleration", "ẍ"),
    "cart_acceleration": ("cart acceleration", "ÿ"),
    "impact_force": ("impact force", "Fᵢ"),
    "applied_force": ("applied force", "F"),
    "reaction_force": ("reaction force", "R"),
}


def spoken(channel: str) -> str:
    """A channel in words.

    Example:
        >>> spoken("impact_force")
        'impact force'
    """
    return _WORDS[channel][0] if channel in _WORDS else channel.replace("_", " ")


def label(channel: str, experiment: Experiment) -> Label:
    """Displacements in mm, everything else in SI; angles, and volts that stand for a quantity, stay what they are."""
    words, symbol = spoken(channel), _WORDS.get(channel, ("", channel))[1]
    sensor = experiment.sensors.get(channel)
    if sensor is not None and sensor.sensitivity is None and sensor.unit in ("V", "rad", "deg"):
        return Label(words=words, symbol=symbol, factor=1.0 / factor_to_si(sensor.unit, CHANNELS[channel], channel), unit=sensor.unit)
    unit = si_unit(channel)
    return Label(words=words, symbol=symbol, factor=1e3 if unit == "m" else 1.0, unit="mm" if unit == "m" else unit)


_COORDINATES = {
    "time": "t",
    "excitation phase": "φ",
    "displacement": "u",
    "velocity": "u̇",
    "indentation": "δ",
    "impact speed": "v⁻",
    "time since impact": "t − tⱼ",
}


def coordinate_label(coordinate: str, unit: str) -> Label:
    """A coordinate with a readable unit: metres in mm, short times in ms, angles in degrees.

    Example:
        >>> coordinate_label("displacement", "m").axis
        'displacement u (mm)'
    """
    readable = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "°")} | ({} if coordinate == "time" else {"s": (1e3, "ms")})
    factor, shown = readable.get(unit, (1.0, unit))
    return Label(words=coordinate, symbol=f"{coordinate} {_COORDINATES.get(coordinate, '')}".strip(), factor=factor, unit=shown)
