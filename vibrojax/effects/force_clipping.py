"""A load cell that saturates."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_CEILING_GRID = (0.9, 0.8, 0.65, 0.5)
"""Of the largest force."""
_OUT_OF_REACH = 1e12
"""N"""


def _candidates(scales: ProbeScales) -> list["ForceClipping"]:
    """The ceiling that the record shows, or several below the largest force."""
    if "impact_force" not in scales.channels or scales.force == 0:
        return []
    recorded = scales.ceilings.get("impact_force")
    ceilings = [part * scales.force for part in _CEILING_GRID] if recorded is None else [recorded]
    return [ForceClipping(ceiling) for ceiling in ceilings]


class ForceClipping(AbstractEffect):
    """The force channel shows nothing above its ceiling.

    r = min(F, ceiling). Differentiable but where F is the ceiling.

    Arguments:
        ceiling: N.

    Source: saturation of an amplifier or converter.
    """

    name: ClassVar[str] = "force_clipping"
    summary: ClassVar[str] = "a force channel that saturates"
    equation: ClassVar[str] = "r = min(F, F_max)"
    source: ClassVar[str] = "saturation"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="ceiling", field="ceiling", symbol="F_max", unit="N", start=100.0, lower=1e-6, upper=1e12, meaning="ceiling of the channel"
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates)

    ceiling: Value

    @property
    def is_fault(self) -> bool:
        """Yes."""
        return True

    def scaled(self, factor: Value) -> "ForceClipping":
        """There, or out of reach for a factor of zero: a ceiling has no strength."""
        return dataclasses.replace(self, ceiling=jnp.where(jnp.asarray(factor) > 0, self.ceiling, _OUT_OF_REACH))

    @property
    def channel(self) -> str | None:
        """The load cell's."""
        return "impact_force"

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The load cell's channel under its ceiling."""
        if "impact_force" not in readings:
            return readings
        return readings | {"impact_force": jnp.minimum(readings["impact_force"], self.ceiling)}
