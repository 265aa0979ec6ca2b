"""Excitation taken from a record: piecewise cubic interpolation of what was measured."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.excitation.base import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.shapes import Scalars


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
        """Recorded y, m."""
        return self.position(t)

    def velocity(self, t: Scalars) -> Scalars:
        """Derivative of the recorded y, m/s."""
        return self.position(t, 1)

    def acceleration(self, t: Scalars) -> Scalars:
        """Recorded or derived y'', m/s^2."""
        return self.second_derivative(t)


class SampledForce(AbstractAppliedForce):
    """A force on the hammer as it was recorded."""

    signal: CubicSignal

    def force(self, t: Scalars) -> Scalars:
        """Recorded force, N."""
        return self.signal(t)
