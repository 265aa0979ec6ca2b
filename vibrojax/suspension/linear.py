"""Linear spring and damper."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax.parameters import Parameter
from vibrojax.suspension.base import DAMPING_RATIO, NATURAL_FREQUENCY, AbstractSuspension, Scalars


class Linear(AbstractSuspension):
    """u'' = -2 zeta omega_n u' - omega_n^2 u + drive, with omega_n = 2 pi f_n.

    Source: thesis section 3.4 (beam springs), in modal form.

    Example:
        >>> Linear(damping_ratio=0.0, natural_frequency_hz=0.5).acceleration(jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(0.0)).round(4)
        Array(-9.8696, dtype=float64)
    """

    name: ClassVar[str] = "linear"
    parameters: ClassVar[tuple[Parameter, ...]] = (DAMPING_RATIO, NATURAL_FREQUENCY)

    damping_ratio: float | Float[Array, ""]
    natural_frequency_hz: float | Float[Array, ""]

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration, m/s^2."""
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        return drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * u
