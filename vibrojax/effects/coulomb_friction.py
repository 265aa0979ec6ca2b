"""Dry friction in the suspension."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_CREEP = 5e-4
"""m/s; the jump of the force at rest is spread over this speed either way."""


class CoulombFriction(AbstractEffect):
    """Friction of constant size against the relative velocity.

    force = -F_c tanh(u' / v_c) with v_c = 0.5 mm/s. Sticking is a creep below that speed.

    Arguments:
        friction_force: F_c >= 0, N.

    Source: C. A. de Coulomb, Theorie des machines simples (1785); smoothed as in E. Pennestri et al., Nonlinear Dynamics 83 (2016)
    1785-1801.
    """

    name: ClassVar[str] = "coulomb_friction"
    summary: ClassVar[str] = "dry friction in the suspension"
    equation: ClassVar[str] = "force = -F_c sign(u')"
    source: ClassVar[str] = "Coulomb 1785"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="friction_force",
            field="friction_force",
            symbol="F_c",
            unit="N",
            start=0.1,
            scale=0.1,
            logarithmic=False,
            meaning="friction",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [CoulombFriction(0.01 * scales.flight_force)])
    """A hundredth of the forces in flight."""

    friction_force: Value

    @property
    def switch_speed(self) -> float:
        """Velocity v_c of the switch, m/s."""
        return _CREEP

    def scaled(self, factor: Value) -> "CoulombFriction":
        """Friction in proportion."""
        return dataclasses.replace(self, friction_force=factor * self.friction_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the velocity, N."""
        return -self.friction_force * jnp.tanh(motion.v / _CREEP)
