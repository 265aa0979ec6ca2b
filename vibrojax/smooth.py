"""Elementary functions that stay finite, with finite derivatives, where the textbook ones do not."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from vibrojax.shapes import Number, Scalars

_SINE_SERIES = (
    1.0,
    -0.1666666666666581,
    0.008333333333262877,
    -0.00019841269820093728,
    2.755731607695764e-06,
    -2.5051851494283738e-08,
    1.6047301121780614e-10,
    -7.364645631285608e-13,
)
"""Coefficients of r, r^3, ... of sin r: minimax on [-pi/2, pi/2] with the first held at 1, error 1.1e-16 before rounding."""
_ABOVE, _BELOW = (2027025.0, -270270.0, 6930.0, -36.0), (2027025.0, -945945.0, 51975.0, -630.0, 1.0)
"""tan(x) / x as a ratio of two polynomials in x^2."""
_SMALL_SINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(5))
_SMALL_COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(6))
"""Taylor series of sin(x) / x and cos(x) in x^2: the first term left out is below 1e-13 of the sine for |x| <= 0.2."""
_SQRT_HALF_BITS = int(np.float64(0.5**0.5).view(np.int64))
_ARTANH = tuple(1.0 / odd for odd in range(1, 22, 2))
_LOG_2 = float(np.log(2.0))
_PI_HIGH, _PI_LOW = 3.1415926534682512, 1.2154201013012384e-10
"""pi in two parts; the first has 33 bits, so that a whole number of half turns below 2^19 times it is exact."""


def power(base: Scalars, exponent: Number) -> Scalars:
    """`base ** exponent` for `base >= 0` and `exponent > 0`; zero, with zero derivatives, at and below zero.

    Written as exp(n log d): on CPU an order of magnitude cheaper than the library `pow`, and without its NaN derivative with respect
    to the exponent at zero. For `exponent < 1` the true slope at zero is infinite; here it is zero.
    """
    positive = base > 0
    safe = jnp.where(positive, base, 1.0)
    return jnp.where(positive, jnp.exp(exponent * log(safe)), 0.0)


@jax.custom_jvp
def log(x: Scalars) -> Scalars:
    """Natural logarithm of numbers above 1e-307, to 5e-16: in float64 three times cheaper on CPU than the library's, else the library's.

    With x = 2^e m and m in [sqrt(1/2), sqrt(2)), log x = e log 2 + 2 artanh((m - 1) / (m + 1)). Infinity and NaN stay what they are;
    smaller numbers, zero and negative ones give a finite number without meaning.
    """
    if x.dtype != jnp.float64:
        return jnp.log(x)
    bits = lax.bitcast_convert_type(x, jnp.int64)
    e = (bits - _SQRT_HALF_BITS) >> 52
    m = lax.bitcast_convert_type(bits - (e << 52), jnp.float64)
    s = (m - 1.0) / (m + 1.0)
    square = s * s
    return jnp.where(x < jnp.inf, 2.0 * s * _series(_ARTANH, square) + e.astype(x.dtype) * _LOG_2, x)


log.defjvps(lambda rate, answer, x: rate / x)


def step(x: Scalars, width: Number) -> Scalars:
    """Quintic switch from 0 (x <= -width/2) to 1 (x >= width/2), twice continuously differentiable; width 0 is the sharp switch."""
    s = jnp.clip(x / jnp.where(width > 0, width, 1.0) + 0.5, 0.0, 1.0)
    return jnp.where(width > 0, s**3 * (10.0 + s * (6.0 * s - 15.0)), jnp.where(x > 0, 1.0, 0.0))


def ramp(x: Scalars, width: Number) -> Scalars:
    """Smoothed max(x, 0): the integral of `step`, exactly 0 below -width/2 and exactly x above width/2."""
    sharp = jnp.maximum(x, 0.0)
    safe = jnp.where(width > 0, width, 1.0)
    s = jnp.clip(x / safe + 0.5, 0.0, 1.0)
    inside = safe * s**4 * (2.5 + s * (s - 3.0))
    return jnp.where((width > 0) & (jnp.abs(x) < 0.5 * safe), inside, sharp)


@jax.custom_jvp
def sine(angle: Scalars) -> Scalars:
    """Sine to 5e-16 for |angle| < 1e6, as a polynomial: several times cheaper on CPU than the library's float64 sine.

    Beyond, the error grows with the angle.
    """
    turns = jnp.round(angle * (1.0 / jnp.pi))
    return _sign(turns) * _near_zero(angle, turns)


@jax.custom_jvp
def cosine(angle: Scalars) -> Scalars:
    """Cosine, by the same polynomial and to the same accuracy as `sine`."""
    turns = jnp.round(angle * (1.0 / jnp.pi) - 0.5)
    return -_sign(turns) * _near_zero(angle, turns + 0.5)


sine.defjvps(lambda rate, answer, angle: cosine(angle) * rate)
cosine.defjvps(lambda rate, answer, angle: -sine(angle) * rate)


def _near_zero(angle: Scalars, turns: Scalars) -> Scalars:
    """Sine of what is left of an angle after some half turns, at most pi/2 either way."""
    r = (angle - turns * _PI_HIGH) - turns * _PI_LOW
    square = r * r
    return r * _series(_SINE_SERIES, square)


def _sign(turns: Scalars) -> Scalars:
    """(-1)^turns."""
    return 1.0 - 2.0 * jnp.abs(turns - 2.0 * jnp.round(0.5 * turns))


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
    return angle * _series(_SMALL_SINE, square), _series(_SMALL_COSINE, square)


def _series(coefficients: tuple[float, ...], square: Scalars) -> Scalars:
    total = jnp.full_like(square, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * square + coefficient
    return total
