"""Drag that grows with the square of the velocity."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class QuadraticDrag(AbstractEffect):
    """Drag against the relative velocity, in proportion to its square.

    force = -c_d u' |u'|. Differentiable everywhere.

    Arguments:
        drag_coefficient: c_d >= 0, N s^2/m^2.

    Source: I. Newton, Philosophiae naturalis principia mathematica (1687), book II, section II.
    """

    name: ClassVar[str] = "quadratic_drag"
    summary: ClassVar[str] = "drag that grows with the square of the velocity"
    equation: ClassVar[str] = "force = -c_d u' |u'|"
    source: ClassVar[str] = "Newton 1687"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="drag_coefficient",
            field="drag_coefficient",
            symbol="c_d",
            unit="N s^2/m^2",
            start=1.0,
            logarithmic=False,
            meaning="drag coefficient",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [QuadraticDrag(0.01 * scales.flight_force / scales.speed**2)] if scales.speed else [])
    """At the highest speed, a hundredth of the forces in flight."""

    drag_coefficient: Value

    def scaled(self, factor: Value) -> "QuadraticDrag":
        """Drag in proportion."""
        return dataclasses.replace(self, drag_coefficient=factor * self.drag_coefficient)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the velocity, N."""
        return -self.drag_coefficient * motion.v * jnp.abs(motion.v)
