"""Profiles of the likelihood: of every parameter, and of the pair that is hardest to separate."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.estimation.parameters import Uncertainty, profile_rise
from identification.result.result import LikelihoodProfile, ProfileMap, Profiles
from identification.trajectory.fit import Fitted

_REACH, _POINTS = 3.0, 13
"""Standard errors to either side, and points of a profile."""
_MAP_REACH, _MAP_POINTS = 3.2, 9
"""The same of a map, along each axis of the ellipse."""
_PAIR = ("k_i", "n")


def profiles(fitted: Fitted, spread: Uncertainty, progress: Callable[[str], None]) -> Profiles:
    """Profile of every parameter with a standard error, and a map of k_i and n, or of the two most strongly correlated.

    Args:
        fitted: the fit.
        spread: covariance of its parameters.
        progress: called with a line of text at each step.
    """
    around, places = _Around(fitted=fitted, spread=spread), np.flatnonzero(spread.known)
    single = tuple(around.profile(int(index), progress) for index in places)
    names = [fitted.problem.parameters[index].name for index in places]
    if len(names) < 2:
        return Profiles(single=single, pair=None)
    if set(_PAIR) <= set(names):
        first, second = (fitted.problem.unknowns.index(name) for name in _PAIR)
    else:
        correlation = np.abs(np.triu(spread.correlation(places), 1))
        first, second = (int(places[i]) for i in np.unravel_index(int(np.argmax(correlation)), correlation.shape))
    return Profiles(single=single, pair=around.map((first, second), progress))


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Around:
    """The likelihood about a fit."""

    fitted: Fitted
    spread: Uncertainty

    def profile(self, index: int, progress: Callable[[str], None]) -> LikelihoodProfile:
        """Profile of one parameter."""
        name = self.fitted.problem.parameters[index].name
        progress(f"likelihood profile of {name}")
        shifts = np.linspace(-_REACH, _REACH, _POINTS) * self.spread.stderr[index]
        rise = tuple(profile_rise(self.fitted, {index: float(shift)}, steps=2) for shift in shifts)
        return LikelihoodProfile(name=name, values=tuple(self._physical(index, shift) for shift in shifts), rise=rise)

    def map(self, pair: tuple[int, int], progress: Callable[[str], None]) -> ProfileMap:
        """Map of two parameters, along the axes of their ellipse."""
        names = tuple(self.fitted.problem.parameters[index].name for index in pair)
        root = np.linalg.cholesky(self.spread.covariance[np.ix_(pair, pair)])
        steps, rows = np.linspace(-_MAP_REACH, _MAP_REACH, _MAP_POINTS), []
        for number, one in enumerate(steps, start=1):
            progress(f"likelihood map of {names[0]} and {names[1]}: row {number} of {len(steps)}")
            shifts = [root @ np.array([one, other]) for other in steps]
            rises = [profile_rise(self.fitted, dict(zip(pair, map(float, shift), strict=True)), steps=1) for shift in shifts]
            values = [tuple(self._physical(index, s) for index, s in zip(pair, shift, strict=True)) for shift in shifts]
            rows.append([(*value, rise) for value, rise in zip(values, rises, strict=True)])
        first, second, rise = (tuple(tuple(cell[part] for cell in row) for row in rows) for part in range(3))
        return ProfileMap(names=(names[0], names[1]), first=first, second=second, rise=rise)

    def _physical(self, index: int, shift: float) -> float:
        problem = self.fitted.problem
        internal = self.fitted.at.shared[index] / problem.border.shared_scale[index]
        return problem.parameters[index].to_physical(float(internal + shift))
