"""A force on the hammer that is linear between equidistant instants."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.excitation.base import AbstractAppliedForce
from vibrojax.excitation.unforced import Unforced
from vibrojax.shapes import Scalars


class PiecewiseLinearForce(AbstractAppliedForce):
    """A force given at equidistant knots, linear between them, beside another one; beyond the last knots it stays as it is there.

    Arguments:
        start: time of the first knot, s.
        spacing: from one knot to the next, s, above zero.
        values: at the knots, N.
        beside: the force to which it is added.

    Example:
        >>> force = PiecewiseLinearForce(start=0.0, spacing=0.5, values=jnp.asarray([1.0, 3.0]))
        >>> float(force.force(jnp.asarray(0.25))), float(force.force(jnp.asarray(9.0)))
        (2.0, 3.0)
    """

    start: float | Float[Array | np.ndarray, "*batch"]
    spacing: float | Float[Array | np.ndarray, "*batch"]
    values: Float[Array | np.ndarray, "*batch knots"]
    beside: AbstractAppliedForce = Unforced()

    def force(self, t: Scalars) -> Scalars:
        """Sum of both, N."""
        last = self.values.shape[-1] - 1
        place = jnp.clip((t - self.start) / self.spacing, 0.0, last)
        left = jnp.clip(jnp.floor(place).astype(int), 0, max(last - 1, 0))
        part = place - left.astype(place.dtype)
        return self.beside.force(t) + (1.0 - part) * self.values[left] + part * self.values[jnp.minimum(left + 1, last)]
