"""Lankarani and Nikravesh's contact law: damping from a restitution close to one."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.contact.base import (
    IMPACT_EXPONENT,
    IMPACT_STIFFNESS,
    RESTITUTION,
    AbstractCompliantLaw,
    power_law_contact_time,
    relative_rate,
)
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class LankaraniNikravesh(AbstractCompliantLaw):
    """Hunt–Crossley law whose damping is set from a wanted restitution, assuming that little energy is lost.

    F = k_i delta^n (1 + 3 (1 - e^2) / 4 delta' / v0), never negative.

    The restitution that results is Hunt and Crossley's with a = 3 (1 - e^2) / 4, whatever the speed. It exceeds the wanted e by
    3 (1 - e)^2 / 2 as e -> 1 (0.9 gives 0.913, 0.8 gives 0.847) and never falls below 0.663: 0.5 gives 0.725.
    Differentiable everywhere but where the clipping acts, and at an approach speed of `SLOWEST_APPROACH`, below which v0 is taken as that.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        restitution: e in (0, 1], 1.

    Source: H. M. Lankarani, P. E. Nikravesh, A contact force model with hysteresis damping for impact analysis of multibody systems,
    J. Mech. Des. 112 (1990) 369-376; clipped at zero, and any exponent.

    Example:
        >>> law = LankaraniNikravesh(impact_stiffness=1e6, impact_exponent=1.5, restitution=0.8)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.2), jnp.asarray(0.2))), 6)
        1.27
    """

    name: ClassVar[str] = "lankarani-nikravesh"
    title: ClassVar[str] = "Lankarani–Nikravesh (1990)"
    parameters: ClassVar[tuple[Parameter, ...]] = (IMPACT_STIFFNESS, IMPACT_EXPONENT, RESTITUTION)

    impact_stiffness: Value
    impact_exponent: Value
    restitution: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i delta^n max(1 + 3 (1 - e^2) / 4 delta' / v0, 0), N."""
        elastic = self.impact_stiffness * smooth.power(indentation, self.impact_exponent)
        loss = 0.75 * (1.0 - self.restitution**2)
        return elastic * jnp.maximum(1.0 + loss * relative_rate(rate, approach_speed), 0.0)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Elastic contact time, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)
