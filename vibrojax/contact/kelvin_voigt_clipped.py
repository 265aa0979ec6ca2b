"""Linear spring and dashpot that only pushes."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax.contact.base import LINEAR_DAMPING, LINEAR_STIFFNESS, AbstractCompliantLaw
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class KelvinVoigtClipped(AbstractCompliantLaw):
    """Linear spring and dashpot that lets go as soon as it would pull; still jumps to k_i lambda_i v0 at touch.

    F = k_i max(delta + lambda_i delta', 0).

    With omega = sqrt(k_i / m) and zeta = lambda_i omega / 2 < 1, the force vanishes after (pi - atan2(2 zeta r, 1 - 2 zeta^2)) / (omega r),
    r = sqrt(1 - zeta^2), and e = exp(-zeta (pi - atan2(2 zeta r, 1 - 2 zeta^2)) / r), whatever the speed; with zeta > 1,
    e = exp(-zeta / s ln((zeta + s) / (zeta - s))), s = sqrt(zeta^2 - 1). The rest of the indentation is left without force.
    Differentiable everywhere but on the line delta + lambda_i delta' = 0, where the clipping acts.

    Arguments:
        impact_stiffness: k_i > 0, N/m.
        impact_damping: lambda_i >= 0, s.

    Source: T. Schwager, T. Pöschel, Coefficient of restitution and linear-dashpot model revisited, Granular Matter 9 (2007) 465-469; the
    dashpot written as k_i lambda_i, their two branches of the arctangent as one `atan2`.

    Example:
        >>> law = KelvinVoigtClipped(impact_stiffness=1e6, impact_damping=1e-3)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(-0.2), jnp.asarray(0.3))), 6)
        0.0
    """

    name: ClassVar[str] = "kelvin-voigt-clipped"
    title: ClassVar[str] = "Kelvin–Voigt, pushing only"
    parameters: ClassVar[tuple[Parameter, ...]] = (LINEAR_STIFFNESS, LINEAR_DAMPING)

    impact_stiffness: Value
    impact_damping: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """F = k_i max(delta + lambda_i delta', 0), N."""
        return self.impact_stiffness * jnp.maximum(indentation + self.impact_damping * rate, 0.0)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Half a period of the undamped oscillator, s."""
        return jnp.pi * jnp.sqrt(mass / self.impact_stiffness) + jnp.zeros_like(approach_speed)
