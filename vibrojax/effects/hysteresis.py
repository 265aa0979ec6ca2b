"""Memory in the suspension."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_YIELD_GRID = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Of the largest deflection."""


class Hysteresis(AbstractEffect):
    """Bouc-Wen memory that does not depend on the rate: elastic after every reversal, then sliding at a constant force.

    force = -F_h z,   d z' = u' - |u'| z / 2 - u' |z| / 2.

    z lies between -1 and 1; a reversal is followed by a straight line of slope F_h / d. That is Wen's law with A = 1/d,
    beta = gamma = 1/(2 d) and exponent 1. Differentiable everywhere.

    Arguments:
        hysteresis_force: F_h >= 0, N.
        yield_displacement: d > 0, m.

    Source: Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249-263, equation 2.
    """

    name: ClassVar[str] = "hysteresis"
    summary: ClassVar[str] = "memory in the suspension (Bouc-Wen hysteresis)"
    equation: ClassVar[str] = "force = -F_h z,  d z' = u' - |u'| z/2 - u' |z|/2"
    source: ClassVar[str] = "Wen 1976"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="hysteresis_force",
            field="hysteresis_force",
            symbol="F_h",
            unit="N",
            start=0.1,
            scale=0.1,
            logarithmic=False,
            meaning="force when sliding",
        ),
        Parameter(
            name="yield_displacement",
            field="yield_displacement",
            symbol="d",
            unit="m",
            start=2e-3,
            lower=1e-6,
            upper=10.0,
            meaning="way from rest to sliding",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="memory", unit="1", scale=0.5),)
    probe: ClassVar[Probe] = Probe(
        lambda scales: [Hysteresis(0.02 * scales.flight_force, part * scales.amplitude) for part in _YIELD_GRID if scales.amplitude]
    )
    """A fiftieth of the forces in flight, yielding at several parts of the largest deflection."""

    hysteresis_force: Value
    yield_displacement: Value

    def scaled(self, factor: Value) -> "Hysteresis":
        """Force in proportion, at the same yield displacement."""
        return dataclasses.replace(self, hysteresis_force=factor * self.hysteresis_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """What the memory pulls back with, N."""
        return -self.hysteresis_force * own[..., 0]

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """z'."""
        z, v = own[..., 0], motion.v
        return ((v - 0.5 * jnp.abs(v) * z - 0.5 * v * jnp.abs(z)) / self.yield_displacement)[..., None]
