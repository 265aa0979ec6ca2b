"""Dry friction in the suspension."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_CREEP = 5e-4
"""m/s; usual width of the jump at rest."""


class CoulombFriction(AbstractEffect):
    """Friction of constant size against the relative velocity.

    force = -F_c tanh(u' / v_c). Sticking is a creep below v_c.

    Arguments:
        friction_force: F_c >= 0, N.
        creep_speed: v_c > 0, m/s, over which the jump of the force at rest is spread either way.

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
        Parameter(
            name="creep_speed",
            field="creep_speed",
            symbol="v_c",
            unit="m/s",
            start=_CREEP,
            lower=2e-5,
            upper=1e-2,
            meaning="speed below which the hammer creeps",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [CoulombFriction(0.01 * scales.flight_force)])
    """A hundredth of the forces in flight."""

    friction_force: Value
    creep_speed: Value = _CREEP

    @property
    def switch_speed(self) -> Value:
        """Velocity v_c of the switch, m/s."""
        return self.creep_speed

    def scaled(self, factor: Value) -> "CoulombFriction":
        """Friction in proportion."""
        return dataclasses.replace(self, friction_force=factor * self.friction_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the velocity, N."""
        return -self.friction_force * jnp.tanh(motion.v / self.creep_speed)
