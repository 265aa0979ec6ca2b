"""A gap that opens or closes steadily."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.effects.base import AbstractEffect, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PROBE_WAY = 2e-3
"""Of the largest deflection, by the end of the longest record."""


class GapDrift(AbstractEffect):
    """The stop moves away from the hammer, or towards it, at a steady rate from the zero of the clock of every record.

    gap(t) = gap + g t. Differentiable everywhere.

    Arguments:
        gap_rate: g, m/s; above zero the gap opens.

    Source: kinematics.
    """

    name: ClassVar[str] = "gap_drift"
    summary: ClassVar[str] = "a gap that opens or closes steadily during a record"
    equation: ClassVar[str] = "gap(t) = gap + g t"
    source: ClassVar[str] = "kinematics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gap_rate",
            field="gap_rate",
            symbol="g",
            unit="m/s",
            start=1e-4,
            lower=-np.inf,
            scale=1e-4,
            logarithmic=False,
            meaning="rate at which the gap opens",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [GapDrift(_PROBE_WAY * scales.amplitude / scales.latest)] if scales.force and scales.latest else [],
        either_sign=True,
    )
    """By the end of the longest record, a five-hundredth of the largest deflection."""

    gap_rate: Value

    def scaled(self, factor: Value) -> "GapDrift":
        """Rate in proportion."""
        return dataclasses.replace(self, gap_rate=factor * self.gap_rate)

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        """g t, m."""
        return self.gap_rate * t

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        """The rate, m/s."""
        return self.gap_rate + jnp.zeros_like(t)
