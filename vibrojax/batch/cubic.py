"""The largest value of a cubic through the ends of a step."""

import jax.numpy as jnp

from vibrojax.shapes import Scalars


def top(p0: Scalars, m0: Scalars, p1: Scalars, m1: Scalars) -> Scalars:
    """Largest value on [0, 1] of the cubic with these values and slopes at 0 and 1.

    Looked for inside only where the cubic rises at 0 and falls at 1; elsewhere the larger end is returned.

    Example:
        >>> one = jnp.asarray(1.0)
        >>> float(top(0 * one, one, 0 * one, -one))
        0.25
    """
    turns = (m0 > 0) & (m1 < 0)
    c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, m0 + m1 - 2.0 * (p1 - p0)
    root = jnp.sqrt(jnp.maximum(c2 * c2 - 3.0 * c3 * m0, 0.0))
    sigma = jnp.where(turns, m0 / jnp.where(turns, root - c2, 1.0), 0.0)
    return jnp.where(turns, p0 + sigma * (m0 + sigma * (c2 + sigma * c3)), jnp.maximum(p0, p1))
