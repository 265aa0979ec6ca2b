"""A fit in which windows that resist count little, and settle anew from several states before they are given up."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.block_arrow import Equations
from identification.discrepancy.refit import Fitted, windows_of
from identification.discrepancy.robust import Tolerance
from identification.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.lanes import initial_states
from identification.layout import Estimate
from identification.levenberg_marquardt import LevenbergMarquardt, settle
from identification.prepare import Prepared
from identification.settling import settled_gradually

_ROUNDS = 3
_CRAWL, _CRAWL_IN_SHORT = 3e-3, 1e-2
"""Share of the misfit, lost windows apart, below which a fit crawls."""
_GIVES_WAY = 3
"""Iterations of all else."""
_WORSE = 3.0
"""Chi-square over the median of the windows from which one of them resists."""
_FEW = 0.1
"""Share of the windows that resist up to which they are tried from more states."""
_TELLS = 8.0
"""Half chi-square by which a fuller model must fit a window better for the window to be tried from its state there."""
_ASIDE = 0.05
"""Of the rms displacement and velocity."""


def fit_tolerantly(
    prepared: Prepared, allowed: Tolerance, *, newest: str = "", give_up_above: float = np.inf, in_short: bool = False
) -> Fitted | None:
    """Everything from `prepared.start`: first roughly, then, after the windows that resist have settled anew, until it is there or crawls.

    Where an effect is the `newest`, all else first gives way to it, its shared parameters held as proposed: beside numbers that have made
    up for its lack, it looks worse than none. None where the rough fit leaves a tolerant cost above `give_up_above`. `in_short`:
    near enough to compare causes that are still far apart.
    """
    evaluate = evaluator(prepared, integrator_for(prepared))
    tolerant, active, limits = allowed.evaluator(evaluate), free_unknowns(prepared), bounds(prepared)
    start, method = _followed(prepared, evaluate, allowed), LevenbergMarquardt(tolerance=0.5, flat=1e-3, most_iterations=8)
    if newest:
        old = np.array([not p.name.startswith(f"{newest}.") for p in prepared.layout.parameters])
        others = dataclasses.replace(active, shared=active.shared & old)
        start = dataclasses.replace(method, most_iterations=_GIVES_WAY)(tolerant, start, others, limits).estimate
    rough = method(tolerant, start, active, limits)
    settled, equations = resettled(prepared, evaluate, rough.estimate, allowed)
    if not allowed.total(equations.cost) <= give_up_above:
        return None
    crawl, rounds = (_CRAWL_IN_SHORT, 1) if in_short else (_CRAWL, _ROUNDS)
    floor = allowed.noise + float(np.sum(allowed.cost(equations.cost), where=~np.isfinite(equations.cost)))
    to_the_end = LevenbergMarquardt(tolerance=0.1, flat=1e-7, most_iterations=20, crawl=crawl, floor=floor)
    for _ in range(rounds):
        outcome = to_the_end(tolerant, settled, active, limits)
        before = float(outcome.equations.cost.sum())
        settled, equations = resettled(prepared, evaluate, outcome.estimate, allowed)
        if before - allowed.total(equations.cost) < 1e-3 * before:
            break
    return Fitted(prepared=prepared, outcome=dataclasses.replace(outcome, estimate=settled, equations=equations))


def _followed(prepared: Prepared, evaluate: Callable[[Estimate], Equations], allowed: Tolerance) -> Estimate:
    """`prepared.start`, where the windows that a new effect has set astray have settled gradually; the longer they are, the more do."""
    estimate = prepared.start
    cost = evaluate(estimate).cost
    resisting = _resisting(cost, allowed.samples)
    if not len(resisting):
        return estimate
    gradually, found = settled_gradually(windows_of(prepared, resisting), integrator_for(prepared))
    lower = found < cost[resisting]
    states = estimate.states.copy()
    states[resisting[lower]] = gradually.states[lower]
    return dataclasses.replace(estimate, states=states)


def resettled(
    prepared: Prepared, evaluate: Callable[[Estimate], Equations], estimate: Estimate, allowed: Tolerance
) -> tuple[Estimate, Equations]:
    """Windows that resist settle from where they are, from the recorded state, and from where the window before them ends.

    Where only a few resist, also from states around the recorded one, and from the recorded one on ever more of the window. Each keeps
    the best; with the normal equations there.
    """
    found = evaluate(estimate)
    resisting = _resisting(found.cost, allowed.samples)
    if not len(resisting):
        return estimate, found
    part = windows_of(prepared, resisting)
    read = np.concatenate([initial_states(group, prepared.motions) for group in part.groups])
    read = np.concatenate([read, estimate.states[resisting, read.shape[1] :]], axis=1)
    starts, iterations = [estimate.states[resisting], read, _continued(prepared, estimate, found)[resisting]], 4
    if len(resisting) <= _FEW * len(found.cost):
        gradually, _ = settled_gradually(
            dataclasses.replace(part, start=dataclasses.replace(estimate, states=read)), integrator_for(prepared)
        )
        starts, iterations = [*starts, gradually.states, *_around(read, estimate.states)], 8
    states = estimate.states.copy()
    states[resisting] = _best(prepared, resisting, estimate, np.stack(starts, axis=1), iterations)
    estimate = dataclasses.replace(estimate, states=states)
    return estimate, evaluate(estimate)


def _best(prepared: Prepared, chosen: np.ndarray, estimate: Estimate, starts: np.ndarray, iterations: int) -> np.ndarray:
    """(chosen, states): where each of these windows fits best after settling from its `starts`, (chosen, starts, states), side by side."""
    windows, count, size = starts.shape
    copies = windows_of(prepared, np.repeat(chosen, count))
    trial = dataclasses.replace(estimate, states=starts.reshape(-1, size))
    settled, cost = settle(evaluator(copies, integrator_for(prepared)), trial, iterations=iterations)
    best = np.argmin(np.nan_to_num(cost, nan=np.inf, posinf=np.inf).reshape(windows, count), axis=1)
    return settled.states.reshape(starts.shape)[np.arange(windows), best]


def fitted_from(fitted: Fitted, fuller: Fitted, allowed: Tolerance) -> Fitted:
    """The model fitted anew from the numbers that a fuller one has found, if it does better there than where it is; else as it is.

    A fit that has ended in a wrong place may be led out of it by an effect, whatever the effect: that is no evidence for it. `fuller`
    has the same windows, and what its newest effect brings comes last.
    """
    prepared, found = fitted.prepared, fuller.outcome.estimate
    values = fuller.prepared.layout.physical(found.shared)
    there = Estimate(
        shared=prepared.layout.internal({p.name: values[p.name] for p in prepared.layout.parameters}),
        nuisances=found.nuisances[:, : len(prepared.layout.nuisances)],
        states=found.states[:, : prepared.layout.states],
    )
    cost = evaluator(prepared, integrator_for(prepared))(there).cost
    if not allowed.total(cost) < allowed.total(fitted.outcome.equations.cost):
        return fitted
    anew = fit_tolerantly(dataclasses.replace(prepared, start=there), allowed)
    return fitted if anew is None else anew


def settled_like(fitted: Fitted, fuller: Fitted) -> Fitted:
    """The model where the few windows that a fuller one fits better have also settled from the states that they have there.

    A window that has settled on a wrong motion may find the right one when an effect is added, whatever the effect: that is no evidence
    for it. `fuller` has the same windows, and the same states before those of its newest effect.
    """
    estimate, cost = fitted.outcome.estimate, fitted.outcome.equations.cost
    better = np.flatnonzero(~(cost - fuller.outcome.equations.cost < _TELLS))
    if not 0 < len(better) <= _FEW * len(cost):
        return fitted
    part = windows_of(fitted.prepared, better)
    states = fuller.outcome.estimate.states[better, : estimate.states.shape[1]]
    trial, found = settle(evaluator(part, integrator_for(fitted.prepared)), dataclasses.replace(estimate, states=states), iterations=8)
    lower = found < cost[better]
    if not lower.any():
        return fitted
    states = estimate.states.copy()
    states[better[lower]] = trial.states[lower]
    estimate = dataclasses.replace(estimate, states=states)
    equations = evaluator(fitted.prepared, integrator_for(fitted.prepared))(estimate)
    return dataclasses.replace(fitted, outcome=dataclasses.replace(fitted.outcome, estimate=estimate, equations=equations))


def _resisting(cost: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Windows that are fitted worse than most, or lost."""
    x = np.where(np.isfinite(cost), 2.0 * cost, np.inf) / np.maximum(samples, 1)
    return np.flatnonzero(x > _WORSE * max(float(np.median(x)), 1.0))


def _around(read: np.ndarray, states: np.ndarray) -> list[np.ndarray]:
    """A little further and less far, faster and slower than read."""
    size = np.sqrt(np.mean(states[:, :2] ** 2, axis=0))
    steps = _ASIDE * np.concatenate([np.diag(size), -np.diag(size)])
    return [np.concatenate([read[:, :2] + step, read[:, 2:]], axis=1) for step in steps]


def _continued(prepared: Prepared, estimate: Estimate, found: Equations) -> np.ndarray:
    """Initial states where each window goes on from the one before it; as they are where there is none."""
    first = np.concatenate([group.first for group in prepared.groups])
    end = first + np.concatenate([group.lengths for group in prepared.groups])
    before = {(record, last): window for window, (record, last) in enumerate(zip(prepared.record, end, strict=True))}
    states = estimate.states.copy()
    for window, (record, start) in enumerate(zip(prepared.record, first, strict=True)):
        source = before.get((record, start))
        if source is not None and np.all(np.isfinite(found.onward[source])):
            states[window] = found.onward[source]
    return states
