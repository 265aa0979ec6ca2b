"""Hunt and Crossley's law with an exponent of its own for the damping."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.contact.base import IMPACT_EXPONENT, IMPACT_STIFFNESS, AbstractCompliantLaw, power_law_contact_time
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_DAMPING = Parameter(
    name="lambda_i",
    field="impact_damping",
    symbol="λ_i",
    unit="s m^(n-n_2-1)",
    start=0.3,
    lower=1e-9,
    upper=1e9,
    meaning="contact damping factor",
)
_DAMPING_EXPONENT = Parameter(
    name="n_2",
    field="damping_exponent",
    symbol="n_2",
    unit="1",
    start=1.5,
    lower=0.1,
    upper=4.0,
    logarithmic=False,
    meaning="damping exponent",
)


class HuntCrossleySeparate(AbstractCompliantLaw):
    """Nonlinear spring and a damper that grows with another power of the indentation.

    F = k_i delta^n + k_i lambda_i delta^n2 delta', never negative.

    With n2 = n this is `HuntCrossley`. With n2 != n the restitution depends on mass and stiffness too; for little damping the energy lost
    in one impact is 2 k_i lambda_i v0 delta_max^(n2+1) B((n2+1)/(n+1), 3/2) / (n+1), B the beta function and delta_max the elastic depth.
    With n2 < n the force reaches zero before the indentation does and is clipped there.
    Differentiable everywhere but where the clipping acts; at delta = 0 all derivatives are taken as zero (true for n > 1 and n2 > 1, or
    at a rate of zero).

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1.
        impact_damping: lambda_i >= 0, s m^(n-n2-1).
        damping_exponent: n2 > 0, 1.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445; their damping force b x^p x'^q with p = n2, q = 1 and b = k_i lambda_i, clipped at zero. The lost energy is ours, from the
    elastic velocity v0 sqrt(1 - (delta/delta_max)^(n+1)).

    Example:
        >>> law = HuntCrossleySeparate(impact_stiffness=1e6, impact_exponent=1.5, impact_damping=0.2, damping_exponent=1.0)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.1), jnp.asarray(0.1))), 3)
        3.0
    """

    name: ClassVar[str] = "hunt-crossley-separate"
    title: ClassVar[str] = "Hunt–Crossley (1975), separate exponents"
    parameters: ClassVar[tuple[Parameter, ...]] = (IMPACT_STIFFNESS, IMPACT_EXPONENT, _DAMPING, _DAMPING_EXPONENT)

    impact_stiffness: Value
    impact_exponent: Value
    impact_damping: Value
    damping_exponent: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i max(delta^n + lambda_i delta^n2 delta', 0), N."""
        damping = self.impact_damping * smooth.power(indentation, self.damping_exponent) * rate
        return self.impact_stiffness * jnp.maximum(smooth.power(indentation, self.impact_exponent) + damping, 0.0)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Elastic contact time, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)
