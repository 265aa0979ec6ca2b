"""Where a step crosses the boundary of contact."""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float

_Scalars = Float[Array, "..."]
_GRAZE = 1e-6
"""m/s; a touch slower than this is a graze: the derivative of its time grows without bound and is taken as zero."""


def crossing(
    before: _Scalars, rate_before: _Scalars, after: _Scalars, rate_after: _Scalars, h: _Scalars
) -> tuple[Bool[Array, "..."], _Scalars]:
    """Whether the cubic through both ends of a step rises above zero on its way, if only for a moment, and when it first does.

    A step starts at or below zero by definition, whatever rounding says. Newton's method starts from the root of a parabola, which is
    right even where a step starts on the boundary and comes back to it after a small part of its length.

    Arguments:
        before: signed distance past the boundary at the start of the step, m.
        rate_before: its rate, m/s.
        after: distance at the end, m.
        rate_after: rate at the end, m/s.
        h: length of the step, s.

    Returns:
        crosses, and the time from the start of the step, s, without derivative (see `landing_correction`).
    """
    p0, m0, p1, m1 = (lax.stop_gradient(x) for x in (jnp.minimum(before, 0.0), h * rate_before, after, h * rate_after))
    turns = (p1 <= 0) & (m0 > 0) & (m1 < 0)
    top = jnp.where(turns, m0 / jnp.where(turns, m0 - m1, 1.0), 1.0)
    p_top, _ = _hermite(top, p0, m0, p1, m1)
    crosses = p_top > 0

    s = jnp.where(crosses, top * _parabola_root(p0, top * m0, p_top), 0.0)
    low, high = jnp.zeros_like(s), top
    for _ in range(4):
        value, slope = _hermite(s, p0, m0, p1, m1)
        low, high = jnp.where(value > 0, low, s), jnp.where(value > 0, s, high)
        newton = s - value / jnp.where(slope == 0, 1.0, slope)
        s = jnp.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return crosses, lax.stop_gradient(s * h)


def landing_correction(distance: _Scalars, rate: _Scalars) -> _Scalars:
    """Newton correction of the time of a landing, s: its value is rounding error, its derivative is that of the landing time."""
    moving = jnp.abs(rate) > _GRAZE
    return jnp.where(moving, -distance / jnp.where(moving, rate, 1.0), 0.0)


def _parabola_root(p0: _Scalars, slope: _Scalars, p1: _Scalars) -> _Scalars:
    """Upward root in [0, 1] of the parabola from p0 <= 0, with that slope there, to p1 > 0; without cancellation."""
    a = p1 - p0 - slope
    root = jnp.sqrt(jnp.maximum(slope**2 - 4.0 * a * p0, 0.0))
    rising = slope > 0
    over = jnp.where(rising, slope + root, 2.0 * a)
    return jnp.where(rising, -2.0 * p0, root - slope) / jnp.where(over == 0, 1.0, over)


def _hermite(s, p0, m0, p1, m1):
    """Cubic Hermite polynomial and its slope on [0, 1]."""
    c2, c3 = 3 * (p1 - p0) - 2 * m0 - m1, m0 + m1 - 2 * (p1 - p0)
    return p0 + s * (m0 + s * (c2 + s * c3)), m0 + s * (2 * c2 + 3 * s * c3)
