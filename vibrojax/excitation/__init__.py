"""Motion of the cart and force on the hammer, one kind a file."""

from vibrojax.excitation.base import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.excitation.harmonic import Harmonic, at_rest
from vibrojax.excitation.piecewise import PiecewiseLinearForce
from vibrojax.excitation.sampled import CubicSignal, SampledForce, SampledMotion
from vibrojax.excitation.unforced import Unforced

__all__ = [
    "AbstractAppliedForce",
    "AbstractBaseMotion",
    "CubicSignal",
    "Harmonic",
    "PiecewiseLinearForce",
    "SampledForce",
    "SampledMotion",
    "Unforced",
    "at_rest",
]
