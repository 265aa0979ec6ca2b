"""A second stop behind the hammer."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_OUT_OF_REACH = 1e3
"""m"""
_DEPTHS_M = (3e-5, 6e-5, 1.2e-4, 2.5e-4, 5e-4)
_OF_WAY = 0.02
"""How far the hammer goes into candidates: in metres, and as a part of its way to the back."""


class BackStop(AbstractEffect):
    """A stop behind the hammer, of the same law as the one in front.

    contact for -u - gap_b > 0, its push towards the stop in front. The load cell is in front and does not feel it.

    Arguments:
        distance: gap_b, m, from the hammer at rest.

    Source: S. W. Shaw, The dynamics of a harmonically excited system having rigid amplitude constraints, J. Appl. Mech. 52 (1985) 453-464,
    with compliant stops.
    """

    name: ClassVar[str] = "back_stop"
    summary: ClassVar[str] = "a second stop behind the hammer"
    equation: ClassVar[str] = "F_b = F(-u - gap_b, -u') towards the stop in front"
    source: ClassVar[str] = "Shaw 1985"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="back_gap",
            field="distance",
            symbol="gap_b",
            unit="m",
            start=5e-3,
            scale=1e-3,
            logarithmic=False,
            meaning="distance of the stop behind",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [BackStop(-scales.lowest - depth) for depth in (*_DEPTHS_M, -_OF_WAY * scales.lowest) if depth < -scales.lowest],
        is_stop=True,
    )
    """Stops that the hammer just reaches."""

    distance: Value

    def scaled(self, factor: Value) -> "BackStop":
        """There, or out of reach for a factor of zero: a stop has no strength."""
        return dataclasses.replace(self, distance=jnp.where(jnp.asarray(factor) > 0, self.distance, _OUT_OF_REACH))

    @property
    def back_gap(self) -> Value:
        """Where it stands, m."""
        return self.distance
