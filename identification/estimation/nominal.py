"""Fit of the nominal model under the full likelihood, on windows of ordinary length or, where that diverges, on short ones."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from identification.estimation.short_windows import robust_estimate
from identification.experiment import Experiment
from identification.least_squares.fit import bounds, evaluator, fit, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt
from identification.least_squares.settling import settled_gradually
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.likelihood.joint import Point, point
from identification.likelihood.random_effects import variations, with_variation
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, prepare
from vibrojax.errors import NoConvergenceError

_MOST_ITERATIONS = 15
_NEAR = 10.0
"""Largest mean squared residual at which an ordinary fit with slow convergence is continued."""
_BAD = 4.0
"""Mean squared whitened residual above which a window counts as diverged."""
_SOME, _FEW = 0.4, 0.1
"""Largest share of diverged windows after one round, and in the end."""


def nominal_fit(experiment: Experiment, *, law: str | None = None, progress: Callable[[str], None] = lambda stage: None) -> Fitted:
    """Fit the nominal model, on ordinary windows if most of them converge; else on short ones, which tolerate a larger model error.

    Raises:
        NoConvergenceError: it cannot be integrated in any window.
    """
    progress("reading first guesses from the records")
    prepared = prepare(experiment, law=law)
    progress("fitting the nominal model")
    start = ordinary(prepared)
    progress("estimating sensor noise and random force")
    found = None if start is None else if_near(first_point(prepared, start))
    if found is not None:
        return found
    return on_short_windows(prepared, progress)


def on_short_windows(prepared: Prepared, progress: Callable[[str], None]) -> Fitted:
    """The fit on short windows of the same records.

    Raises:
        NoConvergenceError: none of them can be integrated.
    """
    progress("fitting the nominal model to short windows")
    return fitted(first_point(*robust_estimate(prepared)))


def on_ordinary_windows(prepared: Prepared, found: Fitted) -> Fitted | None:
    """A fit on ordinary windows that starts from one on short windows; None where it does not get near the recorded motion."""
    begin = dataclasses.replace(prepared.start, shared=found.estimate.shared, nuisances=found.estimate.nuisances)
    estimate, cost = settled_gradually(dataclasses.replace(prepared, start=begin), integrator_for(prepared))
    return if_near(first_point(prepared, estimate)) if np.isfinite(cost).any() else None


def if_near(start: Point) -> Fitted | None:
    """The fit from a point; None where most windows are diverged after the first round, or too many in the end."""
    rough = fitted(start, rounds=1, iterations=6, measure_noise=False)
    if not is_near(rough, share=_SOME):
        return None
    found = fitted(rough.point)
    return found if is_near(found) else None


def is_near(of: Fitted, *, share: float = _FEW) -> bool:
    """Whether at most that share of the windows has diverged from the recorded motion."""
    each = of.posterior.deviation() / np.maximum(of.point.inner.samples, 1)
    return float(np.mean(~of.point.at.finite | (each > _BAD))) <= share


def ordinary(prepared: Prepared) -> Estimate | None:
    """Least-squares fit on ordinary windows; None where it does not converge inside its bounds."""
    try:
        outcome = fit(prepared, method=LevenbergMarquardt(most_iterations=_MOST_ITERATIONS))
        samples = sum(int((group.weight > 0).sum()) for group in prepared.groups)
        if not outcome.converged and 2.0 * outcome.cost <= _NEAR * samples:
            evaluate = evaluator(prepared, integrator_for(prepared))
            outcome = LevenbergMarquardt()(evaluate, outcome.estimate, free_unknowns(prepared), bounds(prepared))
    except NoConvergenceError:
        return None
    (low, high), shared = bounds(prepared), outcome.estimate.shared
    inside = np.all((shared > low) & (shared < high) | ~free_unknowns(prepared).shared)
    return outcome.estimate if outcome.converged and inside else None


def with_variations(found: Fitted, names: Sequence[str], progress: Callable[[str], None]) -> Fitted:
    """The fit with a value of these parameters for each record, about a common mean.

    The standard deviation between records is estimated by restricted maximum likelihood. A parameter stays common to all records where that
    estimate is zero, or where fewer than two records identify it.
    """
    for name in names:
        one = next((each for each in variations(found) if each.name == name), None)
        if one is not None and one.std > 0.0:
            progress(f"fitting {name} with a value for each record")
            prepared = with_variation(found, one)
            found = fitted(point(prepared, prepared.start, found.variances), rounds=3, measure_noise=False)
    return found
