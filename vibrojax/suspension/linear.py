"""Linear spring and damper."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value
from vibrojax.suspension.base import DAMPING_RATIO, NATURAL_FREQUENCY, AbstractSuspension


class Linear(AbstractSuspension):
    """Linear spring and dashpot between hammer and cart.

    u'' = -2 zeta omega_n u' - omega_n^2 u + drive, with omega_n = 2 pi f_n. Differentiable everywhere.

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0, Hz.

    Source: thesis section 3.4 (beam springs), in modal form.

    Example:
        >>> suspension = Linear(damping_ratio=0.0, natural_frequency_hz=0.5)
        >>> round(float(suspension.acceleration(jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -9.8696
    """

    name: ClassVar[str] = "linear"
    parameters: ClassVar[tuple[Parameter, ...]] = (DAMPING_RATIO, NATURAL_FREQUENCY)

    damping_ratio: Value
    natural_frequency_hz: Value

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration, m/s^2."""
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        return drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * u
