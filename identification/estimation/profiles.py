"""Profiles of the likelihood: of every parameter, and of the pair that is hardest to separate."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.least_squares.block_arrow import Equations
from identification.least_squares.uncertainty import Uncertainty, profile_cost
from identification.likelihood.fitted import Fitted
from identification.likelihood.joint import point
from identification.likelihood.marginal import estimated_force
from identification.likelihood.variances import equations
from identification.result.result import LikelihoodProfile, ProfileMap, Profiles
from identification.windows.layout import Active, Estimate

_REACH, _POINTS = 3.0, 13
"""Standard errors to either side, and points of a profile."""
_MAP_REACH, _MAP_POINTS = 3.2, 9
"""The same of a map, along each axis of the ellipse."""
_PAIR = ("k_i", "n")


def likelihood_around(of: Fitted) -> Callable[[Estimate], Equations]:
    """Function from a point near the mode of a fit to the normal equations of its likelihood, at its variances and window weights."""
    record = of.point.at.record

    def evaluate(estimate: Estimate) -> Equations:
        step = estimate.local(record) - of.estimate.local(record)
        force, _ = estimated_force(of.point.inner, of.point.marginal, step)
        at = point(of.prepared, dataclasses.replace(estimate, force=force), of.variances, like=of.point)
        return equations(at.linear, at.marginal, of.variances.weight * at.at.finite)

    return evaluate


def profiles(of: Fitted, known: Active, spread: Uncertainty, progress: Callable[[str], None]) -> Profiles:
    """Profile of every parameter with a standard error, and a map of k_i and n, or of the two most strongly correlated.

    Args:
        of: the fit.
        known: unknowns that are identifiable; of the parameters those that are not at a bound.
        spread: their covariance.
        progress: called with a line of text at each step.
    """
    around = _Around(of=of, known=known, sigma=np.where(known.shared, spread.stderr[: len(known.shared)], 0.0))
    single = tuple(around.profile(int(index), progress) for index in np.flatnonzero(around.sigma))
    names = [of.prepared.layout.parameters[index].name for index in np.flatnonzero(around.sigma)]
    if len(names) < 2:
        return Profiles(single=single, pair=None)
    if set(_PAIR) <= set(names):
        pair = (of.prepared.layout.index(_PAIR[0]), of.prepared.layout.index(_PAIR[1]))
    else:
        correlation = np.abs(np.triu(spread.correlation(np.flatnonzero(around.sigma)), 1))
        first, second = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
        pair = (of.prepared.layout.index(names[int(first)]), of.prepared.layout.index(names[int(second)]))
    return Profiles(single=single, pair=around.map(pair, spread, progress))


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Around:
    """The likelihood about a fit; `sigma` are the standard errors of the parameters, internal coordinates, zero where there is none."""

    of: Fitted
    known: Active
    sigma: np.ndarray

    def profile(self, index: int, progress: Callable[[str], None]) -> LikelihoodProfile:
        """Profile of one parameter."""
        spec = self.of.prepared.layout.parameters[index]
        progress(f"likelihood profile of {spec.name}")
        shifts = np.linspace(-_REACH, _REACH, _POINTS) * self.sigma[index]
        values = tuple(spec.to_physical(self.of.estimate.shared[index] + shift) for shift in shifts)
        return LikelihoodProfile(name=spec.name, values=values, rise=tuple(self._rise({index: float(shift)}) for shift in shifts))

    def map(self, pair: tuple[int, int], spread: Uncertainty, progress: Callable[[str], None]) -> ProfileMap:
        """Map of two parameters, along the axes of their ellipse."""
        specs = [self.of.prepared.layout.parameters[index] for index in pair]
        root = np.linalg.cholesky(spread.covariance[np.ix_(pair, pair)])
        steps, rows = np.linspace(-_MAP_REACH, _MAP_REACH, _MAP_POINTS), []
        for number, one in enumerate(steps, start=1):
            progress(f"likelihood map of {specs[0].name} and {specs[1].name}: row {number} of {len(steps)}")
            shifts = [root @ np.array([one, other]) for other in steps]
            rises = [self._rise(dict(zip(pair, map(float, shift), strict=True))) for shift in shifts]
            rows.append([(*self._physical(pair, shift), rise) for shift, rise in zip(shifts, rises, strict=True)])
        first, second, rise = (tuple(tuple(cell[part] for cell in row) for row in rows) for part in range(3))
        return ProfileMap(names=(specs[0].name, specs[1].name), first=first, second=second, rise=rise)

    def _physical(self, pair: tuple[int, int], shift: np.ndarray) -> tuple[float, float]:
        parameters, shared = self.of.prepared.layout.parameters, self.of.estimate.shared
        first, second = (parameters[index].to_physical(shared[index] + s) for index, s in zip(pair, shift, strict=True))
        return first, second

    def _rise(self, shifts: dict[int, float]) -> float:
        """Twice the fall of the profile log-likelihood from its maximum."""
        of, at_mode = self.of, self.of.posterior.equations
        cost = profile_cost(likelihood_around(of), at_mode, of.estimate, self.known, shifts)
        return float(2.0 * (cost - at_mode.total(of.estimate)))
