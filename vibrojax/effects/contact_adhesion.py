"""A stop that holds the hammer back."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_REACH_GRID = (0.01, 0.02, 0.04, 0.08)
"""Of the largest deflection."""
_EDGE = 0.1
"""Depth below the surface, relative to the reach, over which the pull sets in while the hammer leaves."""
_CREEP = 5e-4
"""m/s; the pull appears over this change of speed where the hammer turns."""


class ContactAdhesion(AbstractEffect):
    """A pull towards the stop while the hammer leaves it, full at the surface and falling linearly to nothing at the reach.

    force = P,  load cell = F - P,  P = F_ad min(1, 1 + delta / d_ad) for -d_ad < delta < 0 and delta' < 0, else 0.

    P sets in smoothly over 0 < delta < d_ad / 10, that is just before the release, and over 0.5 mm/s where the hammer turns. It has no
    memory: it acts on any motion away from the stop inside the reach. Differentiable; at delta = -d_ad once.

    Arguments:
        adhesion_force: F_ad >= 0, N.
        adhesion_reach: d_ad > 0, m.

    Source: a cohesive zone that softens linearly, A. Hillerborg, M. Modeer, P.-E. Petersson, Cement and Concrete Research 6 (1976) 773-781;
    acting on separation alone, as adhesion with hysteresis does (K. L. Johnson, Contact Mechanics (1985), section 5.5).
    """

    name: ClassVar[str] = "contact_adhesion"
    summary: ClassVar[str] = "a stop that holds the hammer back while it leaves"
    equation: ClassVar[str] = "force = P,  load cell = F - P,  P = F_ad min(1, 1 + delta/d_ad) while leaving, -d_ad < delta < 0"
    source: ClassVar[str] = "Hillerborg, Modeer and Petersson 1976"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="adhesion_force",
            field="adhesion_force",
            symbol="F_ad",
            unit="N",
            start=0.5,
            scale=0.5,
            logarithmic=False,
            meaning="largest pull",
        ),
        Parameter(
            name="adhesion_reach", field="adhesion_reach", symbol="d_ad", unit="m", start=4e-4, lower=1e-6, upper=1.0, meaning="reach"
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [ContactAdhesion(0.05 * scales.flight_force, part * scales.amplitude) for part in _REACH_GRID if scales.force]
    )
    """A twentieth of the forces in flight, over several reaches."""

    adhesion_force: Value
    adhesion_reach: Value

    def scaled(self, factor: Value) -> "ContactAdhesion":
        """Pull in proportion, over the same reach."""
        return dataclasses.replace(self, adhesion_force=factor * self.adhesion_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Towards the stop, N."""
        depth = motion.indentation / self.adhesion_reach
        falling = jnp.clip(1.0 + depth, 0.0, 1.0) * smooth.step(0.5 * _EDGE - depth, _EDGE)
        return self.adhesion_force * falling * smooth.step(-motion.indentation_rate, _CREEP)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The load cell feels the pull too."""
        if "impact_force" not in readings:
            return readings
        return readings | {"impact_force": readings["impact_force"] - self.force(motion, own)}
