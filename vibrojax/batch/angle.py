"""Sine and cosine together, as short polynomials without any reduction of the angle."""

import jax.numpy as jnp
import numpy as np

from vibrojax.shapes import Scalars

_SINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(10))
_COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(11))
"""Taylor series of sin(x) / x and cos(x) in x^2: the first term left out is below 3e-17 for |x| <= pi/2."""


def sine_cosine(angle: Scalars) -> tuple[Scalars, Scalars]:
    """Sine and cosine of an angle in [0, 2 pi], rad, to 1e-15: several times cheaper on CPU than the library's two functions.

    Half the angle, less a quarter turn, lies in [-pi/2, pi/2]; the double-angle formulae lead back.

    Example:
        >>> s, c = sine_cosine(jnp.asarray(1.0))
        >>> round(float(s), 6), round(float(c), 6)
        (0.841471, 0.540302)
    """
    x = 0.5 * angle - 0.5 * np.pi
    square = x * x
    s, c = x * _series(_SINE, square), _series(_COSINE, square)
    # With x the half angle less a quarter turn, the angle is 2 x + pi.
    return -2.0 * s * c, 2.0 * s * s - 1.0


def small_rotation(angle: Scalars) -> tuple[Scalars, Scalars]:
    """Sine and cosine of an angle below 0.2 rad in size, to 1e-13 of the angle."""
    square = angle * angle
    return angle * _series(_SINE[:5], square), _series(_COSINE[:6], square)


def _series(coefficients: tuple[float, ...], square: Scalars) -> Scalars:
    total = jnp.full_like(square, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * square + coefficient
    return total
