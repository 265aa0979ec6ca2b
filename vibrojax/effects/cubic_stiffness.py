"""A suspension that hardens or softens."""

import dataclasses
from typing import ClassVar

import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class CubicStiffness(AbstractEffect):
    """Restoring force with the cube of the relative displacement, beside that of the linear spring.

    force = -k_3 u^3. Differentiable everywhere.

    Arguments:
        cubic_stiffness: k_3, N/m^3; above zero hardens, below softens.

    Source: G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918).
    """

    name: ClassVar[str] = "cubic_stiffness"
    summary: ClassVar[str] = "a hardening or softening suspension"
    equation: ClassVar[str] = "force = -k_3 u^3"
    source: ClassVar[str] = "Duffing 1918"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="cubic_stiffness",
            field="cubic_stiffness",
            symbol="k_3",
            unit="N/m^3",
            start=1e5,
            lower=-np.inf,
            scale=1e5,
            logarithmic=False,
            meaning="cubic stiffness",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [CubicStiffness(0.01 * scales.flight_force / scales.amplitude**3)] if scales.amplitude else [], either_sign=True
    )
    """At the largest deflection, a hundredth of the forces in flight."""

    cubic_stiffness: Value

    def scaled(self, factor: Value) -> "CubicStiffness":
        """Stiffness in proportion."""
        return dataclasses.replace(self, cubic_stiffness=factor * self.cubic_stiffness)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the displacement where it hardens, N."""
        return -self.cubic_stiffness * motion.u * motion.u * motion.u
