"""Linear spring and dashpot, pulling force included."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax.contact.base import LINEAR_DAMPING, LINEAR_STIFFNESS, AbstractCompliantLaw
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class KelvinVoigt(AbstractCompliantLaw):
    """Linear spring and dashpot while delta > 0; jumps to k_i lambda_i v0 at touch and pulls the hammer back while it leaves.

    F = k_i (delta + lambda_i delta').

    With omega = sqrt(k_i / m) and zeta = lambda_i omega / 2 < 1, contact is one half period pi / (omega sqrt(1 - zeta^2)) of a damped
    oscillator and e = exp(-pi zeta / sqrt(1 - zeta^2)), whatever the speed; with zeta >= 1 the hammer never leaves.
    Linear, hence differentiable everywhere inside contact; the jump at touch is the caller's switch.

    Arguments:
        impact_stiffness: k_i > 0, N/m.
        impact_damping: lambda_i >= 0, s.

    Source: W. Goldsmith, Impact: The Theory and Physical Behaviour of Colliding Solids, Arnold (1960), linear viscoelastic model; the
    dashpot written as k_i lambda_i.

    Example:
        >>> law = KelvinVoigt(impact_stiffness=1e6, impact_damping=1e-3)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(-0.2), jnp.asarray(0.3))), 6)
        -100.0
    """

    name: ClassVar[str] = "kelvin-voigt"
    title: ClassVar[str] = "Kelvin–Voigt"
    parameters: ClassVar[tuple[Parameter, ...]] = (LINEAR_STIFFNESS, LINEAR_DAMPING)

    impact_stiffness: Value
    impact_damping: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i (delta + lambda_i delta'), N, of either sign."""
        return self.impact_stiffness * (indentation + self.impact_damping * rate)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Half a period of the undamped oscillator, s."""
        return jnp.pi * jnp.sqrt(mass / self.impact_stiffness) + jnp.zeros_like(approach_speed)
