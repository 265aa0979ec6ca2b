"""A cart driven by a pure sine, or at rest."""

import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.excitation.base import AbstractBaseMotion
from vibrojax.shapes import Scalars, Value


class Harmonic(AbstractBaseMotion):
    """A cart driven by a pure sine; amplitude 0 is a cart at rest.

    y = A0 sin(Omega t + base_phase), Omega = 2 pi f. Differentiable everywhere.

    Arguments:
        base_amplitude: A0, m.
        base_phase: rad.
        frequency_hz: f, Hz.

    Example:
        >>> base = Harmonic(base_amplitude=0.002, base_phase=0.0, frequency_hz=5.0)
        >>> round(float(base.displacement(jnp.asarray(0.05))), 6)
        0.002
    """

    base_amplitude: Value
    base_phase: Value
    frequency_hz: Value

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
