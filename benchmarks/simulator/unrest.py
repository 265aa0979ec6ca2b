"""What every real rig does and no simulated one does by itself: it does not repeat itself, and its noise is not white.

Three kinds, each drawn from numbers of its own, so that none depends on which others are asked for. To add one: draw its size in
`with_unrest` and let it change the records' plans or the sensors, then list it in `UNREST`.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from benchmarks.simulator.experiment import RecordPlan
from benchmarks.simulator.random_force import RandomForce
from benchmarks.simulator.rig import SCATTERED, Rig
from benchmarks.simulator.sensors import Sensor

UNREST = ("force", "colour", "scatter")
"""A random force on the hammer, coloured sensor noise, parameters and gaps that differ between records."""
SHARE = (0.002, 0.02)
"""Of the random force's rms in k A0."""
CORNER = (3.0, 60.0)
"""Of the random force, Hz."""
COLOUR = (300.0, 1500.0)
"""Of the sensor noise's two equal poles, Hz."""
SCATTER = (0.001, 0.005)
"""Relative standard deviation of what differs between records."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Unrest:
    """What was drawn for one rig; None where it is not there."""

    share: float | None = None
    """Rms of the random force over k A0."""
    corner: float | None = None
    """Hz"""
    colour: float | None = None
    """Hz"""
    scatter: float | None = None

    def numbers(self) -> dict[str, float | None]:
        """The same under the names of the truth file."""
        return {"unrest": self.share, "corner": self.corner, "colour": self.colour, "scatter": self.scatter}


def with_unrest(
    rng: np.random.Generator, kinds: Sequence[str], rig: Rig, plans: tuple[RecordPlan, ...], sensors: tuple[Sensor, ...]
) -> tuple[Unrest, tuple[RecordPlan, ...], tuple[Sensor, ...]]:
    """Draw unrest of these `kinds`, logarithmically uniform, and put it into the records and the sensors.

    It takes no random number from `rng` itself: rig, settings, effects and the white noise stay those of the quiet rig.
    """
    if unknown := set(kinds) - set(UNREST):
        raise ValueError(f"unknown unrest {sorted(unknown)}: expected some of {', '.join(UNREST)}")
    own = dict(zip(UNREST, rng.spawn(len(UNREST)), strict=True))
    share = corner = colour = size = None
    if "force" in kinds:
        share, corner = _drawn(own["force"], SHARE), _drawn(own["force"], CORNER)
        plans = tuple(shaken(own["force"], plan, share * rig.k * rig.base_amplitude, corner) for plan in plans)
    if "colour" in kinds:
        colour = _drawn(own["colour"], COLOUR)
        sensors = tuple(dataclasses.replace(sensor, colour_hz=colour) for sensor in sensors)
    if "scatter" in kinds:
        size = _drawn(own["scatter"], SCATTER)
        plans = tuple(scattered(own["scatter"], plan, rig, size) for plan in plans)
    return Unrest(share=share, corner=corner, colour=colour, scatter=size), plans, sensors


def shaken(rng: np.random.Generator, plan: RecordPlan, rms: float, corner: float) -> RecordPlan:
    """The record with a random force of its own."""
    return dataclasses.replace(plan, random_force=RandomForce(rms=rms, corner=corner, seed=int(rng.integers(2**63))))


def scattered(rng: np.random.Generator, plan: RecordPlan, rig: Rig, size: float) -> RecordPlan:
    """The record with k_i, f_n and zeta of its own; its gap differs by the same share of the gap as set (not at all where that is 0)."""
    own = {name: getattr(rig, name) * (1.0 + size * rng.normal()) for name in SCATTERED}
    return dataclasses.replace(plan, own_rig=dataclasses.replace(rig, **own), true_gap=plan.true_gap + size * plan.gap * rng.normal())


def _drawn(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    """A number between the limits, logarithmically uniform."""
    return float(np.exp(rng.uniform(*np.log(limits))))
