"""A loss that grows with a power of the velocity."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_CREEP = 5e-4
"""m/s; v_c, the speed below which the loss is viscous."""
_EXPONENT_GRID = (0.5, 1.5, 2.5, 3.0)
"""Of candidates; 0 is dry friction, 1 the nominal damping, 2 the quadratic drag."""


def _candidates(scales: ProbeScales) -> list["PowerLawDamping"]:
    """Several exponents; at the highest speed, a hundredth of the forces in flight."""
    if scales.speed == 0:
        return []
    return [PowerLawDamping(0.01 * scales.flight_force / scales.speed**exponent, exponent) for exponent in _EXPONENT_GRID]


class PowerLawDamping(AbstractEffect):
    """Loss against the relative velocity, in proportion to a power of it: of a seal, a film of grease, a fluid damper.

    force = -d u' (u'^2 + v_c^2)^((p - 1)/2) with v_c = 0.5 mm/s, which is -d |u'|^p sign(u') well above v_c. At rest a loss with p < 1
    would be infinitely steep. Differentiable everywhere.

    Arguments:
        power_coefficient: d >= 0, N (s/m)^p.
        exponent: p > 0, 1.

    Source: M. C. Constantinou, M. D. Symans, Experimental study of seismic response of buildings with supplemental fluid dampers, The
    Structural Design of Tall Buildings 2 (1993) 93-132; smoothed by us.
    """

    name: ClassVar[str] = "power_law_damping"
    summary: ClassVar[str] = "a loss that grows with a power of the velocity"
    equation: ClassVar[str] = "force = -d |u'|^p sign(u')"
    source: ClassVar[str] = "Constantinou and Symans 1993"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="power_coefficient",
            field="power_coefficient",
            symbol="d_p",
            unit="N (s/m)^p",
            start=0.1,
            logarithmic=False,
            meaning="force at 1 m/s",
        ),
        Parameter(
            name="exponent", field="exponent", symbol="p", unit="1", start=1.5, lower=0.05, upper=6.0, meaning="power of the velocity"
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates)

    power_coefficient: Value
    exponent: Value

    @property
    def switch_speed(self) -> Value:
        """v_c for an exponent below one, m/s; infinite above, where the force has no switch."""
        return jnp.where(jnp.asarray(self.exponent) < 1.0, _CREEP, jnp.inf)

    @property
    def special_cases(self) -> tuple[str, ...]:
        """p = 2, and p near 0."""
        return "quadratic_drag", "coulomb_friction"

    def scaled(self, factor: Value) -> "PowerLawDamping":
        """Coefficient in proportion, at the same exponent."""
        return dataclasses.replace(self, power_coefficient=factor * self.power_coefficient)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the velocity, N."""
        speed_squared = motion.v * motion.v + _CREEP**2
        return -self.power_coefficient * motion.v * speed_squared ** (0.5 * (self.exponent - 1.0))
