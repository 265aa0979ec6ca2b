"""Robust nominal fit for large model errors: short windows, with reduced weight for those that the model does not fit."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.least_squares.block_arrow import Equations
from identification.least_squares.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt, settle
from identification.windows.layout import GAP_ERROR, Estimate
from identification.windows.prepare import Prepared, prepare, windows_of
from identification.windows.start.contact import contact_start
from identification.windows.windows import WindowLength
from vibrojax.errors import NoConvergenceError

SHORT = WindowLength(impacts=0.5, longest=170)
"""Windows so short that the free initial states absorb most of the model error; none but a free decay's exceeds 256 samples."""
_LEAST_CUT = 4.0
"""Smallest mean squared residual of a window, in variances of the noise, above which its weight is reduced."""
_ORDERLY = 0.3
"""Share of the windows whose residual sets that threshold."""
_ROUNDS = 3
_LOST = 40.0
"""rho over the cut of a window whose integration failed."""
_EVERY = 4
"""Interval of the windows on which the starts are compared."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Robust loss of a window: rho(x) = x up to `cut`, then cut (1 + ln(x / cut)).

    x is the mean squared residual of a window over the noise variance.
    """

    samples: np.ndarray
    """(windows,) count of samples times channels."""
    cut: float

    def weights(self, cost: np.ndarray) -> np.ndarray:
        """Weight of every window, the slope of rho; 0 where the integration failed."""
        x = 2.0 * cost / np.maximum(self.samples, 1)
        return np.where(np.isfinite(cost), np.minimum(1.0, self.cut / np.maximum(x, 1e-300)), 0.0)

    def cost(self, cost: np.ndarray) -> np.ndarray:
        """Half n rho for every window; a failed integration counts as x = e^39 cuts."""
        finite = np.isfinite(cost)
        x = 2.0 * np.where(finite, cost, 0.0) / np.maximum(self.samples, 1)
        far = self.cut * (1.0 + np.log(np.maximum(x, self.cut) / self.cut))
        return 0.5 * self.samples * np.where(finite, np.where(x > self.cut, far, x), _LOST * self.cut)

    def total(self, cost: np.ndarray) -> float:
        """Sum of the robust cost over all windows."""
        return float(self.cost(cost).sum())

    def evaluator(self, evaluate: Callable[[Estimate], Equations]) -> Callable[[Estimate], Equations]:
        """Normal equations of the robust cost; windows whose integration fails are left out."""

        def tolerant(estimate: Estimate) -> Equations:
            found = evaluate(estimate)
            weight = self.weights(found.cost)
            return Equations(
                hessian=np.nan_to_num(found.hessian) * weight[:, None, None],
                gradient=np.nan_to_num(found.gradient) * weight[:, None],
                cost=self.cost(found.cost),
                record=found.record,
            )

        return tolerant


def tolerance(prepared: Prepared, cost: np.ndarray) -> Tolerance:
    """Robust loss with its threshold from the costs of the windows: from `_ORDERLY` of them, or all for free decays without impacts."""
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in prepared.groups])
    x = np.where(np.isfinite(cost), 2.0 * cost / np.maximum(samples, 1), 1e12)
    orderly = 1.0 if prepared.experiment.only_decays else _ORDERLY
    return Tolerance(samples=samples, cut=max(_LEAST_CUT, 2.0 * float(np.quantile(x, orderly))))


def robust_estimate(prepared: Prepared) -> tuple[Prepared, Estimate]:
    """Robust estimate of the nominal model on short windows of the same records.

    Raises `NoConvergenceError` where none of them can be integrated.
    """
    known = {"law": prepared.model.law.name, "smoothing": prepared.smoothing, "most_samples": prepared.most_samples}
    short = prepare(prepared.experiment, window=SHORT, **known)
    evaluate, active, limits = evaluator(short, integrator_for(short)), free_unknowns(short), bounds(short)
    thin = windows_of(short, np.arange(0, len(short.record), _EVERY))
    evaluate_thin = evaluator(thin, integrator_for(short))
    ranked = []
    for start in _starts(short):
        _, cost = settle(evaluate_thin, dataclasses.replace(start, states=thin.start.states), iterations=4)
        ranked.append((float(np.sum(np.log1p(2.0 * np.nan_to_num(cost, posinf=1e12) / tolerance(thin, cost).samples))), start))
    estimate, cost = settle(evaluate, min(ranked, key=lambda pair: pair[0])[1])
    for rough in (True,) * (_ROUNDS - 1) + (False,):
        allowed = tolerance(short, cost)
        method = LevenbergMarquardt(tolerance=0.3 if rough else 0.1, most_iterations=8 if rough else 20)
        outcome = method(allowed.evaluator(evaluate), estimate, active, limits)
        if rough:
            estimate, cost = settle(evaluate, outcome.estimate, iterations=3)
    equations = evaluate(outcome.estimate)
    if not np.isfinite(equations.cost).any():
        raise NoConvergenceError("the nominal model cannot be integrated in any window: check units, signs, mass and gaps")
    return short, outcome.estimate


def _starts(short: Prepared) -> list[Estimate]:
    """First guesses of the fit; where one is at a bound, also guesses in which every contact has its own gap."""
    layout, starts = short.layout, [dataclasses.replace(short.start, shared=shared) for shared in short.candidates.values()]
    (low, high), held = bounds(short), ~free_unknowns(short).shared
    if all(np.all((start.shared > low + 1e-6) & (start.shared < high - 1e-6) | held) for start in starts):
        return starts
    names = tuple(p.name for p in short.model.law.parameters if p.name not in short.fixed)
    for load_cell in (True, False):
        loops = contact_start(
            short.model, list(short.experiment.records), list(short.motions), names, load_cell=load_cell, each_contact=True
        )
        if loops is not None:
            shared = layout.internal(layout.physical(short.start.shared) | loops.values)
            nuisances = short.start.nuisances.copy()
            nuisances[:, GAP_ERROR] = loops.errors
            starts.append(dataclasses.replace(short.start, shared=shared, nuisances=nuisances))
    return starts
