"""No force on the hammer but those of suspension, stop and cart."""

import jax.numpy as jnp

from vibrojax.excitation.base import AbstractAppliedForce
from vibrojax.shapes import Scalars


class Unforced(AbstractAppliedForce):
    """Applied force zero."""

    def force(self, t: Scalars) -> Scalars:
        """Zero, N."""
        return jnp.zeros_like(t)
