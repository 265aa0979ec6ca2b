"""A rig of the thesis as far as it is known: every number with where it comes from."""

import dataclasses
import enum
import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import root_scalar

from vibrojax.contact import HuntCrossley, KelvinVoigtClipped
from vibrojax.continuation import ForcedRig
from vibrojax.data_files import data_path
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.suspension import Linear, Pendulum

NAMES = ("wires", "beam_170", "beam_150", "beam_135", "drilling_hammer")
GRAVITY = 9.81
"""m/s^2, as the thesis's notation states it."""


class Origin(enum.Enum):
    """Where a number comes from."""

    STATED = "stated in the thesis front matter"
    ESTIMATED = "estimated from what the front matter states"
    ASSUMED = "assumed"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Number:
    """One number of a preset.

    Attributes:
        value: SI, frequency in Hz.
        unit: of the value.
        origin: where it comes from.
        why: the reasoning, or the place in the thesis.
    """

    value: float
    unit: str
    origin: Origin
    why: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Preset:
    """A rig: numbers with their origins, gaps, and which suspension and law they belong to.

    Attributes:
        name: one of `NAMES`.
        title: for tables.
        thesis: name of the table in `data/thesis/` whose facts concern it.
        suspension: "pendulum" or "linear".
        law: "kelvin-voigt-clipped" (from stiffness and restitution) or "hunt-crossley".
        gaps: that the rig was set to, m; stated, but where `gap` is among the numbers.
        numbers: by name.
        ranges: what a study sweeps by default: both ends of `frequency_hz`, `gap` and `base_amplitude`, SI.
        point: where a study of one operating point is made: `frequency_hz` and `gap`, SI.
    """

    name: str
    title: str
    thesis: str
    suspension: str
    law: str
    gaps: tuple[float, ...]
    numbers: Mapping[str, Number]
    ranges: Mapping[str, tuple[float, float]]
    point: Mapping[str, float]

    def __getitem__(self, name: str) -> float:
        """Value of a number."""
        return self.numbers[name].value

    @property
    def omega_n(self) -> float:
        """Natural angular frequency, rad/s."""
        return 2.0 * np.pi * self["natural_frequency_hz"]

    def model(self) -> Model:
        """Hammer, suspension and law.

        A pendulum's length is that of a point mass on light wires, g / omega_n^2; the dashpot of the clipped spring-dashpot law is the one
        that gives the restitution.
        """
        zeta, f_n, stiffness = self["damping_ratio"], self["natural_frequency_hz"], self["impact_stiffness"]
        linear = self.suspension == "linear"
        suspension = Linear(zeta, f_n) if linear else Pendulum(zeta, f_n, length=GRAVITY / self.omega_n**2)
        if self.law == HuntCrossley.name:
            law = HuntCrossley(stiffness, self["impact_exponent"], self["impact_damping"])
        else:
            law = KelvinVoigtClipped(stiffness, clipped_dashpot(self["restitution"], stiffness, self["mass"]))
        return Model(mass=self["mass"], suspension=suspension, law=law)

    def rig(self, *, gap: float, frequency: float) -> ForcedRig:
        """The rig at a gap, m, and an excitation frequency, Hz."""
        return ForcedRig(self.model(), gap=gap, base_amplitude=self["base_amplitude"], frequency_hz=frequency)


def read_preset(name: str) -> Preset:
    """A preset by name.

    Raises:
        InputError: no such preset.

    Example:
        >>> preset = read_preset("wires")
        >>> preset.numbers["natural_frequency_hz"].origin.name, preset.gaps
        ('ESTIMATED', (0.0, 0.001, 0.0024))
    """
    if name not in NAMES:
        raise InputError(f"unknown preset {name!r}: expected one of {', '.join(NAMES)}")
    table: dict[str, Any] = tomllib.loads(data_path("presets", f"{name}.toml").read_text(encoding="utf-8"))
    numbers = {key: Number(**(row | {"origin": Origin[row["origin"].upper()]})) for key, row in table["number"].items()}
    settings = {key: table[key] for key in ("title", "thesis", "suspension", "law")}
    gaps = tuple(round(1e-3 * gap, 9) for gap in table["gaps_mm"])
    ranges = {key.removesuffix("_mm"): (_si(key, low), _si(key, high)) for key, (low, high) in table["range"].items()}
    point = {key.removesuffix("_mm"): _si(key, value) for key, value in table["point"].items()}
    return Preset(name=name, **settings, gaps=gaps, numbers=numbers, ranges=ranges, point=point)


def _si(key: str, value: float) -> float:
    return round(1e-3 * value, 9) if key.endswith("_mm") else value


def clipped_dashpot(restitution: float, stiffness: float, mass: float) -> float:
    """lambda_i, s, that gives `KelvinVoigtClipped` a restitution, by its closed form e(zeta) for zeta < 1.

    Example:
        >>> f"{clipped_dashpot(0.75, 1e6, 1.0):.3e}"
        '1.943e-04'
    """

    def miss(zeta: float) -> float:
        r = np.sqrt(1.0 - zeta**2)
        return float(np.exp(-zeta * (np.pi - np.arctan2(2.0 * zeta * r, 1.0 - 2.0 * zeta**2)) / r)) - restitution

    zeta = float(root_scalar(miss, bracket=(1e-9, 0.999), method="bisect").root)
    return 2.0 * zeta / float(np.sqrt(stiffness / mass))
