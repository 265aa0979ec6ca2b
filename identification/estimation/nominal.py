"""Fit of the nominal model under the full likelihood, on windows of ordinary length or, where that diverges, on short ones."""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from identification.estimation.adequacy import OVERALL, chi2_limit
from identification.estimation.multistart import Multistart, StartOutcome
from identification.estimation.short_windows import robust_estimate
from identification.least_squares.fit import bounds, evaluator, fit, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt, Outcome
from identification.least_squares.settling import settled_gradually
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.likelihood.joint import Point
from identification.windows.layout import Active, Estimate
from identification.windows.prepare import Prepared
from vibrojax.errors import NoConvergenceError

_MOST_ITERATIONS = 15
_NEAR = 10.0
"""Largest mean squared residual at which an ordinary fit with slow convergence is continued."""
_BAD = 4.0
"""Mean squared whitened residual above which a window counts as diverged."""
_SOME, _FEW = 0.4, 0.1
"""Largest share of diverged windows after one round, and in the end."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Nominal:
    """The nominal model under the full likelihood, and the least-squares fit that it started from.

    Attributes:
        fitted: on ordinary windows, or on short ones.
        outcome: of least squares; None where the fit started from short windows.
        far: least-squares estimate on ordinary windows that converged, but not near the recorded motion; None where there is none.
        starts: outcome of every start on single impacts, best first; empty where the first fit left no misfit.
    """

    fitted: Fitted
    outcome: Outcome | None
    starts: tuple[StartOutcome, ...]
    far: Estimate | None = None


def nominal_fit(
    prepared: Prepared, *, starts: int | None = None, seed: int = 0, progress: Callable[[str], None] = lambda stage: None
) -> Nominal:
    """Fit the nominal model: `vibrojax diagnose` begins with this.

    Least squares on ordinary windows come first, from several starts where the first one leaves a misfit. Where the result is not near the
    recorded motion, the fit starts from short windows, which tolerate a larger model error and a worse first guess. It returns to ordinary
    windows where the model is adequate on both; otherwise it stays on short ones.

    Args:
        prepared: windows, first guesses and model.
        starts: number of starts; None uses several only where the first fit leaves a misfit, 1 never does.
        seed: of the random starts.
        progress: called with a line of text at each stage.

    Raises:
        NoConvergenceError: the model cannot be integrated in any window.
    """
    progress("fitting the nominal model")
    outcome, tried = _least_squares(prepared, starts, seed, progress)
    if outcome is not None:
        progress("estimating sensor noise and random force")
        found = if_near(first_point(prepared, outcome.estimate))
        if found is not None:
            return Nominal(fitted=found, outcome=outcome, starts=tried)
    far = None if outcome is None else outcome.estimate
    short = on_short_windows(prepared, progress)
    if is_adequate(short):
        progress("fitting the nominal model to ordinary windows again")
        again = on_ordinary_windows(prepared, short)
        if again is not None and is_adequate(again):
            return Nominal(fitted=again, outcome=None, starts=tried)
    return Nominal(fitted=short, outcome=None, starts=tried, far=far)


def is_adequate(of: Fitted) -> bool:
    """Whether the motion without random force explains the records to the noise."""
    return of.chi2_reduced <= chi2_limit(of.samples, OVERALL)


def degrees_of_freedom(prepared: Prepared, active: Active, integrated: Bool[np.ndarray, " windows"] | None = None) -> int:
    """Number of weighted samples less that of estimated unknowns; a window on a prescribed path has no free initial state.

    `integrated`: the windows that count; all of them if left out.
    """
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in prepared.groups])
    free = np.concatenate([np.full(len(group.record), group.prescribed is None) for group in prepared.groups])
    chosen = np.ones(len(samples), bool) if integrated is None else integrated
    counted, free_windows = int(samples[chosen].sum()), int(free[chosen].sum())
    return counted - int(active.shared.sum()) - int(active.nuisances.sum()) - prepared.layout.states * free_windows


def _least_squares(
    prepared: Prepared, starts: int | None, seed: int, progress: Callable[[str], None]
) -> tuple[Outcome | None, tuple[StartOutcome, ...]]:
    """The fit to ordinary windows from the first guesses; where it leaves a misfit, or several starts are wanted, the best of several.

    None where none converges; with it, the outcomes of the starts.
    """
    outcome = ordinary(prepared, progress)
    if starts == 1 or (starts is None and outcome is not None and _explains(prepared, outcome)):
        return outcome, ()
    progress("trying other starts on single impacts")
    other, tried = (Multistart() if starts is None else Multistart(count=starts))(prepared, seed=seed)
    if other is None:
        return outcome, tried
    again = ordinary(dataclasses.replace(prepared, candidates={"multistart": other}), progress)
    return min((one for one in (outcome, again) if one is not None), key=lambda one: one.cost, default=None), tried


def _explains(prepared: Prepared, outcome: Outcome) -> bool:
    """Whether a least-squares fit leaves no more than the noise."""
    degrees = degrees_of_freedom(prepared, free_unknowns(prepared))
    return 2.0 * outcome.cost / max(degrees, 1) <= chi2_limit(degrees, OVERALL)


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
    """Whether at most that share of the windows will have diverged from the recorded motion after the next step, by the linear model."""
    return _diverged(of, of.posterior.deviation()) <= share


def follows_records(of: Fitted) -> bool:
    """Whether the motion, random force included, follows the recorded one in nearly all windows. One that has not converged may not."""
    return _diverged(of, of.point.deviation) <= _FEW


def _diverged(of: Fitted, deviation: Float[np.ndarray, " windows"]) -> float:
    """Share of the windows that are not integrated or whose squared whitened residual is large."""
    return float(np.mean(~of.point.at.finite | (deviation / np.maximum(of.point.inner.samples, 1) > _BAD)))


def ordinary(prepared: Prepared, progress: Callable[[str], None] = lambda stage: None) -> Outcome | None:
    """Least-squares fit on ordinary windows; None where it does not converge, or ends at a bound with a misfit."""

    def shown(stage: str, step: int, cost: float) -> None:
        progress(f"fitting, {stage}: step {step}, chi-square {2.0 * cost:.6g}")

    try:
        outcome = fit(prepared, method=LevenbergMarquardt(most_iterations=_MOST_ITERATIONS), progress=shown)
        samples = sum(int((group.weight > 0).sum()) for group in prepared.groups)
        if not outcome.converged and 2.0 * outcome.cost <= _NEAR * samples:
            evaluate = evaluator(prepared, integrator_for(prepared))
            outcome = LevenbergMarquardt()(evaluate, outcome.estimate, free_unknowns(prepared), bounds(prepared))
    except NoConvergenceError:
        return None
    (low, high), shared = bounds(prepared), outcome.estimate.shared
    inside = np.all((shared > low) & (shared < high) | ~free_unknowns(prepared).shared)
    return outcome if outcome.converged and (inside or _explains(prepared, outcome)) else None
