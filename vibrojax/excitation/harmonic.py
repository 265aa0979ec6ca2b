"""A cart driven by a pure sine, or at rest."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax import smooth
from vibrojax.excitation.base import AbstractBaseMotion, Scalars


class Harmonic(AbstractBaseMotion):
    """y = A0 sin(2 pi f t + base_phase); amplitude 0 is a cart at rest.

    Example:
        >>> Harmonic(base_amplitude=jnp.asarray(0.002), base_phase=jnp.asarray(0.0), frequency_hz=5.0).displacement(jnp.asarray(0.05)).round(6)
        Array(0.002, dtype=float64)
    """

    base_amplitude: float | Float[Array, ""]
    base_phase: float | Float[Array, ""]
    frequency_hz: float | Float[Array, ""]

    def displacement(self, t: Scalars) -> Scalars:
        """A0 sin, m."""
        return self.base_amplitude * smooth.sine(self._angle(t))

    def velocity(self, t: Scalars) -> Scalars:
        """A0 Omega cos, m/s."""
        return self.base_amplitude * 2.0 * jnp.pi * self.frequency_hz * smooth.cosine(self._angle(t))

    def acceleration(self, t: Scalars) -> Scalars:
        """-A0 Omega^2 sin, m/s^2."""
        return -((2.0 * jnp.pi * self.frequency_hz) ** 2) * self.displacement(t)

    def _angle(self, t: Scalars) -> Scalars:
        return 2.0 * jnp.pi * self.frequency_hz * t + self.base_phase


def at_rest() -> Harmonic:
    """A cart that does not move."""
    return Harmonic(base_amplitude=0.0, base_phase=0.0, frequency_hz=0.0)
