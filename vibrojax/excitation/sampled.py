"""Excitation taken from a record: piecewise cubic interpolation of what was measured."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax.excitation.base import AbstractAppliedForce, AbstractBaseMotion, Scalars


class CubicSignal(eqx.Module):
    """Piecewise cubic function of time; beyond the first and last knot the outer pieces go on.

    Arguments:
        knots: times, s, strictly increasing.
        coefficients: of (t - knot)^3, ^2, ^1, ^0 on each piece, in the order of `scipy.interpolate.PPoly`.
    """

    knots: Float[Array, " knots"]
    coefficients: Float[Array, "4 pieces"]

    def __call__(self, t: Scalars, derivative: int = 0) -> Scalars:
        """Value, first or second derivative at t."""
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
