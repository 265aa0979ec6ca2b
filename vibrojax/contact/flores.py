"""Flores and co-workers' contact law: damping from any restitution."""

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


class Flores(AbstractCompliantLaw):
    """Hunt–Crossley law whose damping is set from a wanted restitution, for soft and hard materials alike.

    F = k_i delta^n (1 + 8 (1 - e) / (5 e) delta' / v0), never negative.

    The restitution that results is Hunt and Crossley's with a = 8 (1 - e) / (5 e), whatever the speed. It is close to the wanted e over
    the whole range, below it by at most 0.046 (at e = 0.24): 0.9 gives 0.894, 0.5 gives 0.470, 0.1 gives 0.069.
    Differentiable everywhere but where the clipping acts, and at an approach speed of `SLOWEST_APPROACH`, below which v0 is taken as that.
    Not defined at e = 0.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        restitution: e in (0, 1], 1.

    Source: P. Flores, M. Machado, M. T. Silva, J. M. Martins, On the continuous contact force models for soft materials in multibody
    dynamics, Multibody Syst. Dyn. 25 (2011) 357-375; clipped at zero, and any exponent.

    Example:
        >>> law = Flores(impact_stiffness=1e6, impact_exponent=1.5, restitution=0.8)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.2), jnp.asarray(0.2))), 6)
        1.4
    """

    name: ClassVar[str] = "flores"
    title: ClassVar[str] = "Flores et al. (2011)"
    parameters: ClassVar[tuple[Parameter, ...]] = (IMPACT_STIFFNESS, IMPACT_EXPONENT, RESTITUTION)

    impact_stiffness: Value
    impact_exponent: Value
    restitution: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i delta^n max(1 + 8 (1 - e) / (5 e) delta' / v0, 0), N."""
        elastic = self.impact_stiffness * smooth.power(indentation, self.impact_exponent)
        loss = 1.6 * (1.0 - self.restitution) / self.restitution
        return elastic * jnp.maximum(1.0 + loss * relative_rate(rate, approach_speed), 0.0)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Elastic contact time, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)
