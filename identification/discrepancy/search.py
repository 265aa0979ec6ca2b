"""The search: score everything, refit a short list, keep the best, and look again."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from identification.adequacy import OVERALL, chi2_limit
from identification.block_arrow import Equations
from identification.discrepancy.evidence import significant
from identification.discrepancy.facts import facts
from identification.discrepancy.linearised import Linearised, linearised
from identification.discrepancy.refit import Fitted, extended, windows_of
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate, projector, score
from identification.discrepancy.signature import Course, courses
from identification.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.lanes import initial_states
from identification.layout import Estimate
from identification.levenberg_marquardt import LevenbergMarquardt, settle
from identification.prepare import Prepared
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
_SHORT_LIST = 6
_WORTH_A_TRY = 0.03
"""Share of the best gain that a candidate must promise to be refitted."""
_MOST_EFFECTS = 3
_STOPS = 3
"""Stops that are tried without a score."""
_EVERY, _LARGE_GAIN = 4, 4000.0
"""Where some candidate promises so much, every fourth window tells the candidates apart."""
_FINALIST = 1.03
"""Cost over the lowest up to which a candidate is fitted to all windows."""
_NOISE = 1.05
"""Cost over that of pure noise at which a candidate explains nearly everything."""
_CLOSE = 0.3
"""Share of the best gain from which a candidate is tried although another explains everything: it may be its twin."""
_HOPELESS = 1.2
"""Cost over the lowest of the short list at which a candidate is given up after its rough fit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scored:
    """One look at all candidates from one fitted model."""

    fitted: Fitted
    at: Linearised
    courses: tuple[Course, ...]
    found: list[Candidate]
    significant: dict[str, Candidate]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rival:
    """A candidate after its refit."""

    candidate: Candidate
    fitted: Fitted
    cost: float
    """Tolerant, of all windows."""

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name


@dataclasses.dataclass(frozen=True, kw_only=True)
class Round:
    """One step of the forward search."""

    scored: Scored
    cost: float
    rivals: tuple[Rival, ...]
    """Best first."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Search:
    """What the search went through, and where it ended."""

    rounds: tuple[Round, ...]
    fitted: Fitted
    last: Scored
    explained: bool
    """Whether nothing but noise is left."""


def search(start: Fitted, allowed: Tolerance, deadline: float, progress: Progress = lambda stage: None) -> Search:
    """Add effects to a model until nothing but noise is left, or none of them helps any more."""
    fitted, rounds = start, []
    while True:
        progress(f"scoring all candidates beside {_words(fitted)}")
        scored = look(fitted, allowed)
        cost = float(allowed.cost(fitted.outcome.equations.cost).sum())
        enough = _explained(fitted, allowed, scored, rounds)
        hopeless = not scored.significant and not _beyond_scores(scored, [])
        if enough or hopeless or len(fitted.names) >= _MOST_EFFECTS or time.monotonic() > deadline:
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, explained=enough)
        rivals = _refitted(scored, allowed, progress)
        if not rivals or cost - rivals[0].cost < max(LEAST_GAIN, _HELPS * (cost - 0.5 * allowed.samples.sum())):
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, explained=False)
        rounds.append(Round(scored=scored, cost=cost, rivals=tuple(rivals)))
        fitted = rivals[0].fitted


LEAST_GAIN, _HELPS = 12.0, 0.05
"""Drop of the cost (half chi-square), and share of the misfit, below which a refit has not helped."""
_ROUNDS = 3
_ASTRAY, _LEAST_ASTRAY = 0.02, 25.0
"""Share of the windows that may have settled wrongly without a verdict being drawn from them, and the misfit that tells them."""
_REST = 0.01
"""Share of the first misfit that may be left, because an effect is never modelled to the last digit."""


def look(fitted: Fitted, allowed: Tolerance) -> Scored:
    """Score every candidate that the model does not have yet."""
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    at = linearised(prepared, integrator_for(prepared), estimate)
    along, known = courses(prepared, at, estimate), facts(prepared, at, estimate)
    weights = allowed.weights(fitted.outcome.equations.cost) * at.finite
    by = projector(prepared, at, estimate, free_unknowns(prepared), weights)
    candidates = [one for kind in EFFECTS.values() if kind.name not in fitted.names for one in blank(kind).probes(known)]
    found = score(prepared, by, along, candidates, known.mass)
    return Scored(fitted=fitted, at=at, courses=along, found=found, significant=significant(found))


def blank(kind: type[AbstractEffect]) -> AbstractEffect:
    """An effect with every parameter at its order of magnitude."""
    usual: dict[str, Any] = {p.field: p.start for p in kind.parameters}
    return kind(**usual)


def _explained(fitted: Fitted, allowed: Tolerance, scored: Scored, rounds: list[Round]) -> bool:
    """Whether what is left is noise, or a trifle beside what has been explained."""
    noise = 0.5 * float(allowed.samples.sum())
    misfit = float(allowed.cost(fitted.outcome.equations.cost).sum()) - noise
    first = rounds[0].cost - noise if rounds else 0.0
    left = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    return (adequate(fitted, allowed) or misfit < _REST * first) and left <= _REST * 2.0 * first


def adequate(fitted: Fitted, allowed: Tolerance) -> bool:
    """Whether chi-square is that of noise, a few windows apart that have settled on a wrong number of impacts."""
    x = 2.0 * fitted.outcome.equations.cost / allowed.samples
    most = x <= max(np.quantile(x, 1.0 - _ASTRAY), _LEAST_ASTRAY)
    states = fitted.prepared.layout.states * int(most.sum())
    degrees = int(allowed.samples[most].sum()) - fitted.unknowns - states
    return float(2.0 * fitted.outcome.equations.cost[most].sum()) / degrees <= chi2_limit(degrees, OVERALL)


def _refitted(scored: Scored, allowed: Tolerance, progress: Progress) -> list[Rival]:
    """The short list, each fitted in full as long as it is in the running; best first.

    Where the misfit is large, every candidate is first fitted to a part of the windows, and only the best to all.
    """
    thin = _thinned(scored, allowed)
    rivals = _heats(thin, allowed, scored, progress)
    if thin.every == 1 or not rivals:
        return rivals
    finals, lowest = [], np.inf
    for rival in rivals:
        if rival.cost > _FINALIST * rivals[0].cost + 100.0:
            break
        progress(f"fitting {rival.name} to all records")
        fitted = fit_tolerantly(_with_all_windows(scored, rival), allowed, give_up_above=_HOPELESS * lowest)
        if fitted is not None:
            finals.append(_rival(rival.candidate, fitted, allowed))
            lowest = min(lowest, finals[-1].cost)
    return _ranked(finals, allowed)


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Thinned:
    """Every so manieth window."""

    every: int
    chosen: np.ndarray
    allowed: Tolerance


def _thinned(scored: Scored, allowed: Tolerance) -> _Thinned:
    """A part of the windows that suffices to tell large gains apart."""
    best = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    every = _EVERY if best > _LARGE_GAIN and len(allowed.samples) > 16 * _EVERY else 1
    chosen = np.arange(0, len(allowed.samples), every)
    return _Thinned(every=every, chosen=chosen, allowed=dataclasses.replace(allowed, samples=allowed.samples[chosen]))


def _heats(thin: _Thinned, allowed: Tolerance, scored: Scored, progress: Progress) -> list[Rival]:
    """The short list, fitted to the chosen windows; best first."""
    best = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    short = [one for one in scored.significant.values() if one.gain >= _WORTH_A_TRY * best][:_SHORT_LIST]
    noise, rivals = 0.5 * thin.allowed.samples.sum(), []
    for candidate in [*short, *_beyond_scores(scored, short)]:
        lowest = min((rival.cost for rival in rivals), default=np.inf)
        if lowest < _NOISE * noise and candidate.gain < _CLOSE * best:
            continue
        progress(f"trying {candidate.name} {candidate.members[0].channel or ''} beside {_words(scored.fitted)}")
        prepared = windows_of(extended(scored.fitted, candidate, scored.courses), thin.chosen)
        try:
            fitted = fit_tolerantly(prepared, thin.allowed, give_up_above=max(_HOPELESS * lowest, lowest + 100.0))
        except NoConvergenceError:
            continue
        if fitted is not None:
            rivals.append(_rival(candidate, fitted, thin.allowed))
    return _ranked(rivals, thin.allowed)


def _rival(candidate: Candidate, fitted: Fitted, allowed: Tolerance) -> Rival:
    return Rival(candidate=candidate, fitted=fitted, cost=float(allowed.cost(fitted.outcome.equations.cost).sum()))


def _ranked(rivals: list[Rival], allowed: Tolerance) -> list[Rival]:
    """By cost with the price of every estimated number."""
    return sorted(rivals, key=lambda rival: rival.cost + 0.5 * np.log(allowed.samples.sum()) * rival.fitted.unknowns)


def _with_all_windows(scored: Scored, rival: Rival) -> Prepared:
    """All windows, from what the fit to a part of them found."""
    whole = extended(scored.fitted, rival.candidate, scored.courses)
    found = rival.fitted.outcome.estimate
    return dataclasses.replace(whole, start=dataclasses.replace(whole.start, shared=found.shared, nuisances=found.nuisances))


def _beyond_scores(scored: Scored, short: list[Candidate]) -> list[Candidate]:
    """Stops that the nominal motion passes through: no derivative tells what they would do, so they are tried where windows resist."""
    resisting = float(np.mean(scored.fitted.outcome.equations.cost > 2.0 * np.median(scored.fitted.outcome.equations.cost) + 100.0))
    if resisting < 0.02:
        return []
    listed = {candidate.name for candidate in short}
    stops = [one for one in scored.found if one.members[0].is_stop and one.name not in listed]
    return [dataclasses.replace(one, factors=np.ones(len(one.members))) for one in stops[:_STOPS]]


def fit_tolerantly(prepared: Prepared, allowed: Tolerance, *, give_up_above: float = np.inf) -> Fitted | None:
    """Everything from `prepared.start`: first roughly, then, after the windows that resist have settled anew, to the end.

    None where the rough fit leaves a tolerant cost above `give_up_above`.
    """
    evaluate = evaluator(prepared, integrator_for(prepared))
    tolerant, active, limits = allowed.evaluator(evaluate), free_unknowns(prepared), bounds(prepared)
    rough = LevenbergMarquardt(tolerance=0.5, flat=1e-3, most_iterations=8)(tolerant, prepared.start, active, limits)
    settled, cost = resettled(prepared, evaluate, rough.estimate, allowed)
    if not float(allowed.cost(cost).sum()) <= give_up_above:
        return None
    for _ in range(_ROUNDS):
        outcome = LevenbergMarquardt(tolerance=0.1, flat=1e-7, most_iterations=20)(tolerant, settled, active, limits)
        before = float(allowed.cost(evaluate(outcome.estimate).cost).sum())
        settled, cost = resettled(prepared, evaluate, outcome.estimate, allowed)
        if before - float(allowed.cost(cost).sum()) < 1e-3 * before:
            break
    return Fitted(prepared=prepared, outcome=dataclasses.replace(outcome, equations=evaluate(outcome.estimate)))


def resettled(
    prepared: Prepared, evaluate: Callable[[Estimate], Equations], estimate: Estimate, allowed: Tolerance
) -> tuple[Estimate, np.ndarray]:
    """Windows that resist settle from where they are, from the recorded state, and from where the window before them ends.

    Each keeps the best; with the windows' costs.
    """
    found = evaluate(estimate)
    resisting = np.flatnonzero(~(allowed.weights(found.cost) >= 1.0))
    if not len(resisting):
        return estimate, found.cost
    part = windows_of(prepared, resisting)
    evaluate_part = evaluator(part, integrator_for(prepared))
    read = np.concatenate([initial_states(group, prepared.motions) for group in part.groups])
    read = np.concatenate([read, estimate.states[resisting, read.shape[1] :]], axis=1)
    states, lowest = estimate.states.copy(), found.cost.copy()
    for start in (estimate.states[resisting], read, _continued(prepared, estimate, found)[resisting]):
        trial, cost = settle(evaluate_part, dataclasses.replace(estimate, states=start), iterations=4)
        better = cost < lowest[resisting]
        states[resisting[better]], lowest[resisting[better]] = trial.states[better], cost[better]
    return dataclasses.replace(estimate, states=states), lowest


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


def _words(fitted: Fitted) -> str:
    return " and ".join(fitted.names) if fitted.names else "the nominal model"
