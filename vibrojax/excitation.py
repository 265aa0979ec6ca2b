"""What drives the rig: the motion of the cart, and a force on the hammer.

To add one: write a final subclass of `AbstractBaseMotion` here (implement `displacement`, `velocity` and `acceleration`) or of
`AbstractAppliedForce` (implement `force`).
"""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax import smooth
from vibrojax.shapes import Scalars, Value


class AbstractBaseMotion(eqx.Module):
    """Prescribed motion y(t) of the cart."""

    @abc.abstractmethod
    def displacement(self, t: Scalars) -> Scalars:
        """y, m, at t, s."""

    @abc.abstractmethod
    def velocity(self, t: Scalars) -> Scalars:
        """y', m/s, at t, s."""

    @abc.abstractmethod
    def acceleration(self, t: Scalars) -> Scalars:
        """y'', m/s^2, at t, s."""


class AbstractAppliedForce(eqx.Module):
    """Prescribed force on the hammer."""

    @abc.abstractmethod
    def force(self, t: Scalars) -> Scalars:
        """Force in the direction of the stop, N, at t, s."""


class Harmonic(AbstractBaseMotion):
    """A cart driven by a pure sine; amplitude 0 is a cart at rest.

    y = A0 sin(Omega t + base_phase), Omega = 2 pi f. Differentiable everywhere.

    Arguments:
        base_amplitude: A0, m.
        base_phase: rad.
        frequency_hz: f, Hz.

    Example:
        >>> base = Harmonic(base_amplitude=0.002, base_phase=0.0, frequency_hz=5.0)
        >>> round(float(base.displacement(jnp.asarray(0.05))), 6)
        0.002
    """

    base_amplitude: Value
    base_phase: Value
    frequency_hz: Value

    def displacement(self, t: Scalars) -> Scalars:
        return self.base_amplitude * smooth.sine(self._angle(t))

    def velocity(self, t: Scalars) -> Scalars:
        return self.base_amplitude * 2.0 * jnp.pi * self.frequency_hz * smooth.cosine(self._angle(t))

    def acceleration(self, t: Scalars) -> Scalars:
        return -((2.0 * jnp.pi * self.frequency_hz) ** 2) * self.displacement(t)

    def _angle(self, t: Scalars) -> Scalars:
        return 2.0 * jnp.pi * self.frequency_hz * t + self.base_phase


def at_rest() -> Harmonic:
    """A cart that does not move."""
    return Harmonic(base_amplitude=0.0, base_phase=0.0, frequency_hz=0.0)


class CubicSignal(eqx.Module):
    """Piecewise cubic function of time; beyond the first and last knot the outer pieces go on.

    Differentiable in t as often as its pieces join smoothly; at a knot the derivative is that of the piece on its right.

    Arguments:
        knots: times, s, strictly increasing, one more than pieces.
        coefficients: of (t - knot)^3, ^2, ^1, ^0 on each piece, in the order of `scipy.interpolate.PPoly`.

    Example:
        >>> signal = CubicSignal(knots=jnp.asarray([0.0, 1.0]), coefficients=jnp.asarray([[1.0], [0.0], [0.0], [2.0]]))
        >>> float(signal(jnp.asarray(2.0))), float(signal(jnp.asarray(2.0), 1))
        (10.0, 12.0)
    """

    knots: Float[Array | np.ndarray, "*batch knots"]
    coefficients: Float[Array | np.ndarray, "*batch 4 pieces"]

    def __call__(self, t: Scalars, derivative: int = 0) -> Scalars:
        """Value (`derivative` 0), first (1) or second (2) derivative at t."""
        if derivative not in (0, 1, 2):
            raise ValueError(f"derivative is {derivative}; a cubic signal gives 0, 1 or 2")
        piece = jnp.clip(jnp.searchsorted(self.knots, t, side="right") - 1, 0, self.coefficients.shape[1] - 1)
        s = t - self.knots[piece]
        c3, c2, c1, c0 = self.coefficients[:, piece]
        if derivative == 0:
            return c0 + s * (c1 + s * (c2 + s * c3))
        if derivative == 1:
            return c1 + s * (2.0 * c2 + 3.0 * s * c3)
        return 2.0 * c2 + 6.0 * s * c3


class SampledMotion(AbstractBaseMotion):
    """A cart that moved as it was recorded.

    Displacement and acceleration are given apart, because what was measured well decides which of them is trusted: twice
    differentiating a noisy displacement is left to whoever smooths the record.
    """

    position: CubicSignal
    second_derivative: CubicSignal

    def displacement(self, t: Scalars) -> Scalars:
        return self.position(t)

    def velocity(self, t: Scalars) -> Scalars:
        return self.position(t, 1)

    def acceleration(self, t: Scalars) -> Scalars:
        return self.second_derivative(t)


class SampledForce(AbstractAppliedForce):
    """A force on the hammer as it was recorded."""

    signal: CubicSignal

    def force(self, t: Scalars) -> Scalars:
        return self.signal(t)


class Unforced(AbstractAppliedForce):
    """Applied force zero."""

    def force(self, t: Scalars) -> Scalars:
        return jnp.zeros_like(t)


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
        last = self.values.shape[-1] - 1
        place = jnp.clip((t - self.start) / self.spacing, 0.0, last)
        left = jnp.clip(jnp.floor(place).astype(int), 0, max(last - 1, 0))
        part = place - left.astype(place.dtype)
        return self.beside.force(t) + (1.0 - part) * self.values[left] + part * self.values[jnp.minimum(left + 1, last)]
