"""The step that is taken from an estimate: within the limits of each shared parameter, and shortened where steps go back and forth.

A parameter that would go too far is held at its limit, and the others take the step that is best beside it: one that the records ask to
vanish, such as a damping that a wrong model would rather have negative, does not hold up the rest.

Source: P. E. Gill, W. Murray, M. H. Wright, Practical Optimization (1981), section 5.5 (bounds by an active set).
"""

import numpy as np

from identification.trajectory.elimination import Solution
from identification.trajectory.motion import Estimate
from identification.trajectory.start import Problem

_LONGEST_STEP = 0.7
"""Largest change of a logarithm in one step, but back to its first value, or of a parameter over its scale, and as many times more as the
parameter exceeds its first value; a quarter of its range where that is less."""
NO_STEP = 0.02
"""Step of a parameter over its standard error that no longer changes the likelihood."""


class Stride:
    """How much of each step is taken: none moves a parameter too far, and none goes back and forth.

    Where a parameter's step turns back on the one before, and a share of that was taken, the line through both puts the place of no step at
    about share / (1 + r) of it, with r the ratio of their lengths (secant rule).
    """

    def __init__(self, problem: Problem) -> None:
        border = problem.border
        self._problem, self._scale, self._first = problem, border.shared_scale, problem.start.shared
        self._range = 0.25 * (border.upper - border.lower) / border.shared_scale
        self._last, self._taken = np.zeros(len(border.shared)), 1.0

    def taken(self, at: Estimate, solution: Solution, *, whole: bool = False) -> tuple[Solution, float]:
        """The step from an estimate within its limits, and the share of it that is taken, in 0 to 1.

        Of a `whole` one every part is shortened alike: the way for an estimate that is still far off.
        """
        least, most = _limits(self._problem, at)
        logarithmic = _logarithmic(self._problem)
        size = np.maximum(1.0, np.abs(at.shared) / np.maximum(self._scale, np.abs(self._first)))
        down = np.minimum(np.where(logarithmic, 1.0, size) * _LONGEST_STEP, self._range)
        up = down if whole else np.where(logarithmic, _to_grow(np.maximum(down, self._first - at.shared)), down)
        inside = solution if whole else solution.within(np.maximum(least, -down), np.minimum(most, up))
        step, last = inside.shared, self._last
        share = min(1.0, 1.0 / max(float(np.max(np.abs(step) / np.maximum(np.where(step < 0, down, up), 1e-300), initial=0.0)), 1e-300))
        back = (step * last < 0) & (np.minimum(np.abs(step), np.abs(last)) > NO_STEP * np.sqrt(np.diag(solution.covariance)))
        if back.any():
            ratio = min(float(np.max(np.abs(step[back] / last[back]))), 3.0)  # over the step before, at most
            share = min(share, self._taken / (1.0 + ratio))
        self._last, self._taken = step, share
        return inside, share


def moved(problem: Problem, at: Estimate, solution: Solution, share: float) -> Estimate:
    """The estimate after a share of the step.

    A long step of a logarithm that grows is taken for one of the number itself, x (1 + step): one that is far too small comes back at once.
    """
    border = problem.border
    step = share * solution.shared * border.shared_scale
    grown = np.maximum(np.minimum(step, _LONGEST_STEP), np.log1p(np.maximum(step, 0.0)))
    step = np.where(_logarithmic(problem) & (step > 0.0), grown, step)
    return Estimate(
        states=at.states + share * solution.knots[:, :-1],
        force=at.force + share * solution.knots[:, -1],
        shared=np.clip(at.shared + step, border.lower, border.upper),
        own=at.own + share * solution.own * border.own_scale,
    )


def change(problem: Problem, at: Estimate, solution: Solution) -> float:
    """Largest step of a shared parameter over its standard error; none goes beyond its limit."""
    error = np.sqrt(np.diag(solution.covariance))
    step, free = solution.within(*_limits(problem, at)).shared, error > 0
    return float(np.max(np.abs(step[free]) / error[free], initial=0.0))


def _limits(problem: Problem, at: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """Shortest and longest step of the shared unknowns inside their bounds, scaled; no step leads back from beyond them."""
    border = problem.border
    least, most = ((limit - at.shared) / border.shared_scale for limit in (border.lower, border.upper))
    most = np.where(_logarithmic(problem), _to_grow(most), most)
    return np.minimum(least, 0.0), np.maximum(most, 0.0)


def _logarithmic(problem: Problem) -> np.ndarray:
    """Which shared unknowns move by their logarithm."""
    return np.array([logarithmic for _, logarithmic in problem.unknowns.shared], bool)


def _to_grow(change: np.ndarray) -> np.ndarray:
    """Step by which a logarithm grows by `change`."""
    return np.where(change > _LONGEST_STEP, np.maximum(np.expm1(np.minimum(change, 100.0)), _LONGEST_STEP), change)
