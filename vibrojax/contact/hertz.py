"""Hertz's contact law: elastic, without loss."""

from typing import ClassVar

from vibrojax import smooth
from vibrojax.contact.base import IMPACT_EXPONENT, IMPACT_STIFFNESS, AbstractCompliantLaw, power_law_contact_time
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class Hertz(AbstractCompliantLaw):
    """Nonlinear spring without damping: what comes in with v0 goes out with v0.

    F = k_i delta^n.

    Deepest indentation ((n+1) m v0^2 / (2 k_i))^(1/(n+1)), reached halfway through a contact of
    2 sqrt(pi) Gamma(1 + 1/(n+1)) / Gamma(1/2 + 1/(n+1)) delta_max / v0.
    Differentiable everywhere; at delta = 0 all derivatives are taken as zero, which is the true slope for n > 1.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.

    Source: H. Hertz, Über die Berührung fester elastischer Körper, J. reine angew. Math. 92 (1882) 156-171, where n = 3/2; the general
    exponent and its contact time are textbook extensions by conservation of energy.

    Example:
        >>> import jax.numpy as jnp
        >>> law = Hertz(impact_stiffness=1e6, impact_exponent=1.5)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.1), jnp.asarray(0.1))), 6)
        1.0
    """

    name: ClassVar[str] = "hertz"
    title: ClassVar[str] = "Hertz (1882)"
    parameters: ClassVar[tuple[Parameter, ...]] = (IMPACT_STIFFNESS, IMPACT_EXPONENT)

    impact_stiffness: Value
    impact_exponent: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i delta^n, N."""
        return self.impact_stiffness * smooth.power(indentation, self.impact_exponent)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Contact time to a few per cent, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)
