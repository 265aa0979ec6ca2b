"""Sine and cosine together, as short polynomials without any reduction of the angle."""

import jax.numpy as jnp
import numpy as np

from vibrojax.shapes import Scalars

_ABOVE, _BELOW = (2027025.0, -270270.0, 6930.0, -36.0), (2027025.0, -945945.0, 51975.0, -630.0, 1.0)
"""tan(x) / x as a ratio of two polynomials in x^2."""
_SINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(5))
_COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(6))
"""Taylor series of sin(x) / x and cos(x) in x^2: the first term left out is below 1e-13 of the sine for |x| <= 0.2."""


def sine_cosine(angle: Scalars) -> tuple[Scalars, Scalars]:
    """Sine and cosine of an angle in [0, 2 pi], rad, to 2e-15: several times cheaper on CPU than the library's two functions.

    From the tangent of a quarter of the angle less a quarter turn, in [-pi/4, pi/4], by the double-angle formulae. XLA keeps the results of
    its two divisions; sums it would compute again wherever they are used.

    Source: the eighth convergent of Lambert's continued fraction of the tangent (J. H. Lambert, 1768), off by less than 1e-16.

    Example:
        >>> s, c = sine_cosine(jnp.asarray(1.0))
        >>> round(float(s), 6), round(float(c), 6)
        (0.841471, 0.540302)
    """
    x = 0.25 * angle - 0.25 * np.pi
    square = x * x
    tangent = x * _series(_ABOVE, square) / _series(_BELOW, square)
    cosine_squared = 1.0 / (1.0 + tangent * tangent)
    s, c = 2.0 * tangent * cosine_squared, 2.0 * cosine_squared - 1.0
    # These are of 2 x, and the angle is 4 x + pi.
    return -2.0 * s * c, 2.0 * s * s - 1.0


def small_rotation(angle: Scalars) -> tuple[Scalars, Scalars]:
    """Sine and cosine of an angle below 0.2 rad in size, to 1e-13 of the angle."""
    square = angle * angle
    return angle * _series(_SINE, square), _series(_COSINE, square)


def _series(coefficients: tuple[float, ...], square: Scalars) -> Scalars:
    total = jnp.full_like(square, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * square + coefficient
    return total
