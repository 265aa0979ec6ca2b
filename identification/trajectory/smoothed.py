"""The fit with a smoothed contact, which Diffrax integrates."""

from collections.abc import Callable

from identification.trajectory.fit import Fitted
from identification.trajectory.start import Problem
from vibrojax.errors import InputError


def fit_smoothed(problem: Problem, fitted: Fitted, smoothing: float, progress: Callable[[str], None]) -> dict[str, float]:
    """Parameters, SI, of the law whose contact switch is spread over `smoothing`, m."""
    raise InputError("the smoothed integrator does not fit chains: expected the landing integrator; leave the smoothing out")
