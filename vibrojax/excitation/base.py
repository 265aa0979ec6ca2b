"""What drives the rig: the motion of the cart, and a force on the hammer.

To add one: write a file with a final subclass of `AbstractBaseMotion` (implement `displacement`, `velocity` and `acceleration`) or of
`AbstractAppliedForce` (implement `force`), then list it in `vibrojax/excitation/__init__.py`.
"""

import abc

import equinox as eqx

from vibrojax.shapes import Scalars


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
