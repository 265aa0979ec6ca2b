"""A suspension that hardens or softens with the fifth power of the deflection."""

import dataclasses
from typing import ClassVar

import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class QuinticStiffness(AbstractEffect):
    """Restoring force with the fifth power of the relative displacement, beside that of the linear spring and of a cubic one, if any.

    force = -k_5 u^5. Differentiable everywhere.

    Arguments:
        quintic_stiffness: k_5, N/m^5; above zero hardens, below softens.

    Source: I. Kovacic, M. J. Brennan (editors), The Duffing Equation: Nonlinear Oscillators and their Behaviour (2011), the next odd term
    of the series.
    """

    name: ClassVar[str] = "quintic_stiffness"
    summary: ClassVar[str] = "a suspension that hardens or softens with the fifth power of the deflection"
    equation: ClassVar[str] = "force = -k_5 u^5"
    source: ClassVar[str] = "Kovacic and Brennan 2011"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="quintic_stiffness",
            field="quintic_stiffness",
            symbol="k_5",
            unit="N/m^5",
            start=1e9,
            lower=-np.inf,
            scale=1e9,
            logarithmic=False,
            meaning="quintic stiffness",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [QuinticStiffness(0.01 * scales.flight_force / scales.amplitude**5)] if scales.amplitude else [], either_sign=True
    )
    """At the largest deflection, a hundredth of the forces in flight."""

    quintic_stiffness: Value

    def scaled(self, factor: Value) -> "QuinticStiffness":
        """Stiffness in proportion."""
        return dataclasses.replace(self, quintic_stiffness=factor * self.quintic_stiffness)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the displacement where it hardens, N."""
        square = motion.u * motion.u
        return -self.quintic_stiffness * square * square * motion.u
