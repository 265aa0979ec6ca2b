"""A mass hung by wires, in full geometry."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value
from vibrojax.suspension.base import DAMPING_RATIO, NATURAL_FREQUENCY, AbstractSuspension


class Pendulum(AbstractSuspension):
    """Pendulum in a cart that moves horizontally, written in the horizontal displacement u = L sin(phi).

    L phi'' + 2 zeta omega_n L phi' + omega_n^2 L sin(phi) = drive cos(phi), hence with s = u / L and c = sqrt(1 - s^2)
    u'' = c^2 drive - 2 zeta omega_n u' - omega_n^2 c u - s u'^2 / (L c^2).

    omega_n^2 is g / L for a point mass on light wires and is estimated, so that a real body's inertia is covered. Valid for |u| < L
    (the wire short of horizontal); beyond, c^2 is cut at 1e-6 to stay finite and the motion means nothing. For small u / L this is
    `Linear`; the restoring acceleration at u is weaker by the factor c. Differentiable for |u| < L sqrt(1 - 1e-6).

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0 of small swings, Hz.
        length: L > 0, m; known, not estimated.

    Source: Lagrange's equation for the wires of thesis section 3.3, damping proportional to the angular rate; ours.

    Example:
        >>> suspension = Pendulum(damping_ratio=0.0, natural_frequency_hz=0.5, length=2.0)
        >>> round(float(suspension.acceleration(jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -8.5473
    """

    name: ClassVar[str] = "pendulum"
    parameters: ClassVar[tuple[Parameter, ...]] = (DAMPING_RATIO, NATURAL_FREQUENCY)

    damping_ratio: Value
    natural_frequency_hz: Value
    length: float = eqx.field(static=True)

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative horizontal acceleration, m/s^2."""
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        sine = u / self.length
        cosine_squared = jnp.maximum(1.0 - sine**2, 1e-6)
        centripetal = sine * v**2 / (self.length * cosine_squared)
        return cosine_squared * drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * jnp.sqrt(cosine_squared) * u - centripetal
