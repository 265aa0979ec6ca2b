"""Viscous damping that differs between the two directions of motion."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class AsymmetricDamping(AbstractEffect):
    """Viscous damping with one coefficient towards the stop and another away from it, as in a shock absorber.

    force = -D_c |u'| / 2, where D_c is the coefficient towards the stop less that away from it. The nominal damping is their mean.

    Arguments:
        damping_difference: D_c, N s/m; above zero where motion towards the stop is damped more.

    Source: J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 3 (damper asymmetry).
    """

    name: ClassVar[str] = "asymmetric_damping"
    summary: ClassVar[str] = "a viscous damping that differs between the two directions"
    equation: ClassVar[str] = "force = -D_c |u'| / 2"
    source: ClassVar[str] = "Dixon 2007"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="damping_difference",
            field="damping_difference",
            symbol="D_c",
            unit="N s/m",
            start=0.1,
            lower=-np.inf,
            scale=0.1,
            logarithmic=False,
            meaning="damping towards the stop less damping away from it",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [AsymmetricDamping(0.02 * scales.flight_force / scales.speed)] if scales.speed else [], either_sign=True
    )
    """At the highest speed, a hundredth of the forces in flight."""

    damping_difference: Value

    @property
    def damping_needed(self) -> Value:
        """The mean of both directions: neither coefficient of a passive damper is below zero."""
        return 0.5 * jnp.abs(self.damping_difference)

    def scaled(self, factor: Value) -> "AsymmetricDamping":
        """Difference in proportion."""
        return dataclasses.replace(self, damping_difference=factor * self.damping_difference)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Away from the stop where motion towards it is damped more, N."""
        return -0.5 * self.damping_difference * jnp.abs(motion.v)
