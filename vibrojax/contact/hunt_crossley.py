"""Hunt and Crossley's contact law: the nominal law of this project."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.contact.base import IMPACT_DAMPING, IMPACT_EXPONENT, IMPACT_STIFFNESS, AbstractCompliantLaw, power_law_contact_time
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class HuntCrossley(AbstractCompliantLaw):
    """Nonlinear spring whose damping grows with indentation, so that the force is zero at touch and at release.

    F = k_i delta^n (1 + lambda_i delta'), never negative.

    Restitution e against approach speed v0 obeys a (1 + e) = ln((1 + a) / (1 - a e)), a = lambda_i v0, whatever mass, k_i and n; solved,
    e = (1 + W(-(1 + a) exp(-1 - a))) / a with Lambert's W (principal branch).
    Differentiable everywhere but on the line 1 + lambda_i delta' = 0, where the clipping acts; at delta = 0 all derivatives are taken
    as zero, which is the true slope for n > 1.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        impact_damping: lambda_i >= 0, s/m.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445; their damping force b x^p x'^q with p = n, q = 1 and b = k_i lambda_i, clipped at zero.

    Example:
        >>> law = HuntCrossley(impact_stiffness=2.1e8, impact_exponent=1.6, impact_damping=0.6)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.0), jnp.asarray(0.1))), 1)
        83.6
    """

    name: ClassVar[str] = "hunt-crossley"
    title: ClassVar[str] = "Hunt–Crossley (1975)"
    parameters: ClassVar[tuple[Parameter, ...]] = (IMPACT_STIFFNESS, IMPACT_EXPONENT, IMPACT_DAMPING)

    impact_stiffness: Value
    impact_exponent: Value
    impact_damping: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i delta^n max(1 + lambda_i delta', 0), N."""
        elastic = self.impact_stiffness * smooth.power(indentation, self.impact_exponent)
        return elastic * jnp.maximum(1.0 + self.impact_damping * rate, 0.0)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Elastic contact time, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)
