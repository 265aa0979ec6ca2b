"""No suspension at all."""

from typing import ClassVar

from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars
from vibrojax.suspension.base import AbstractSuspension


class Free(AbstractSuspension):
    """No spring, no damper: a body that moves freely between impacts, such as a rider on an air track.

    u'' = drive. Differentiable everywhere.

    Example:
        >>> import jax.numpy as jnp
        >>> float(Free().acceleration(jnp.asarray(1.0), jnp.asarray(2.0), jnp.asarray(3.0)))
        3.0
    """

    name: ClassVar[str] = "free"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration, m/s^2."""
        return drive
