"""Tilt or preload."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class ConstantForce(AbstractEffect):
    """A force on the hammer that never changes: a rig that stands askew, or a spring that is tight.

    force = F_0. Differentiable everywhere.

    Arguments:
        constant_force: F_0, N, towards the stop.

    Source: statics; on a rig tilted by the angle a, F_0 = m g sin(a).
    """

    name: ClassVar[str] = "constant_force"
    summary: ClassVar[str] = "a constant force on the hammer (tilt or preload)"
    equation: ClassVar[str] = "force = F_0"
    source: ClassVar[str] = "statics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="constant_force",
            field="constant_force",
            symbol="F_0",
            unit="N",
            start=0.1,
            lower=-np.inf,
            scale=0.1,
            logarithmic=False,
            meaning="constant force",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [ConstantForce(0.01 * scales.flight_force)], either_sign=True)
    """A hundredth of the forces in flight."""

    constant_force: Value

    def scaled(self, factor: Value) -> "ConstantForce":
        """Force in proportion."""
        return dataclasses.replace(self, constant_force=factor * self.constant_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """The same always, N."""
        return self.constant_force + jnp.zeros_like(motion.u)
