"""Rigs: their true parameters, and how random ones are drawn."""

import dataclasses
from collections.abc import Mapping

import numpy as np

SCATTERED = ("k_i", "f_n", "zeta")
"""What differs between the records of a rig that scatters."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rig:
    """True parameters of one rig, SI, named as in `fit.json` where the fit estimates them."""

    m: float
    f_n: float
    zeta: float
    k_i: float
    n: float
    lambda_i: float
    base_amplitude: float
    """A0 of the cart's drive, m."""

    @property
    def k(self) -> float:
        """Stiffness of the suspension, N/m."""
        return self.m * (2.0 * np.pi * self.f_n) ** 2

    @property
    def c(self) -> float:
        """Damping of the suspension, N s/m."""
        return 2.0 * self.zeta * self.m * 2.0 * np.pi * self.f_n

    @property
    def fitted(self) -> dict[str, float]:
        """What a fit of the nominal model estimates."""
        return {name: getattr(self, name) for name in ("k_i", "n", "lambda_i", "zeta", "f_n")}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Kind:
    """A family of rigs: ranges of their parameters, and how one works with them."""

    ranges: Mapping[str, tuple[float, float]]
    """Uniform; logarithmically uniform for the contact stiffness."""
    gaps: tuple[float, float, float]
    """As set in the three records with a driven cart, m."""
    frequency_ratios: tuple[float, ...]
    """Excitation over natural frequency: three of these are used."""


KINDS = {
    "soft": Kind(
        ranges={
            "m": (0.31, 0.40),
            "f_n": (1.6, 1.7),
            "zeta": (0.006, 0.012),
            "k_i": (1.0e6, 4.0e6),
            "n": (1.4, 1.6),
            "lambda_i": (0.40, 0.68),
            "base_amplitude": (2.0e-3, 3.0e-3),
        },
        gaps=(1.0e-3, 2.4e-3, 1.0e-3),
        frequency_ratios=(1.65, 2.0, 2.1, 2.45, 3.7, 4.2),
    ),
    "stiff": Kind(
        ranges={
            "m": (0.43, 0.57),
            "f_n": (4.3, 6.4),
            "zeta": (0.008, 0.015),
            "k_i": (2.0e6, 1.0e7),
            "n": (1.4, 1.6),
            "lambda_i": (0.20, 0.57),
            "base_amplitude": (1.3e-3, 1.8e-3),
        },
        gaps=(0.5e-3, 1.0e-3, 0.5e-3),
        frequency_ratios=(1.25, 1.45, 1.6, 1.8, 2.05, 2.3),
    ),
}


def draw_rig(rng: np.random.Generator, kind: str) -> Rig:
    """A random rig of the family `kind`."""
    values = {}
    for name, (low, high) in KINDS[kind].ranges.items():
        values[name] = float(np.exp(rng.uniform(np.log(low), np.log(high))) if name == "k_i" else rng.uniform(low, high))
    return Rig(**values)
