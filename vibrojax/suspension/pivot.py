"""A body on a bearing, in its angle."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value
from vibrojax.suspension.base import DAMPING_RATIO, NATURAL_FREQUENCY, AbstractSuspension


class Pivot(AbstractSuspension):
    """Pendulum on a bearing, written in the arc u = L phi, so that it may swing past horizontal.

    L phi'' + 2 zeta omega_n L phi' + omega_n^2 L sin(phi) = drive, hence u'' = drive - 2 zeta omega_n u' - omega_n^2 L sin(u / L).

    The drive acts along the arc, which is what friction in the bearing, drag and a stop at radius L do. A cart that moves does so only
    at small angles: use it with a cart at rest, or `Pendulum`. omega_n^2 is m g r / J of a body of moment of inertia J whose centre of mass
    lies at r, and is estimated; m is then J / L^2. Differentiable everywhere.

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0 of small swings, Hz.
        length: L > 0, m, at which the displacement is measured; with L = 1 m it is the angle in radians.

    Source: Euler's equation for a body on a fixed axis; ours.

    Example:
        >>> suspension = Pivot(damping_ratio=0.0, natural_frequency_hz=0.5, length=2.0)
        >>> round(float(suspension.acceleration(jnp.asarray(jnp.pi), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -19.7392
    """

    name: ClassVar[str] = "pivot"
    parameters: ClassVar[tuple[Parameter, ...]] = (DAMPING_RATIO, NATURAL_FREQUENCY)

    damping_ratio: Value
    natural_frequency_hz: Value
    length: float = eqx.field(static=True)

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Acceleration along the arc, m/s^2."""
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        return drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * self.length * jnp.sin(u / self.length)
