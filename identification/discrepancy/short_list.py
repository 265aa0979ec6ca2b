"""The candidates that promise most, each fitted with all else."""

import dataclasses
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

from identification.discrepancy.continuity import states_margin, whole_cost
from identification.discrepancy.driven import rings_by_itself
from identification.discrepancy.from_loops import from_loops
from identification.discrepancy.look import Scored
from identification.discrepancy.placed import better_placed
from identification.discrepancy.refit import Fitted, extended, windows_of
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.discrepancy.tried import Tried
from identification.fit import evaluator, integrator_for
from identification.prepare import Prepared
from vibrojax.effects import AbstractEffect

Progress = Callable[[str], None]
HELPS = 0.1
"""Share of the misfit below which a refit has not helped."""
_SHORT_LIST = 6
_WORTH_A_TRY = 0.1
"""Share of the best gain that a candidate must promise to be refitted."""
_STOPS = 3
"""Stops that are tried without a score."""
_EVERY, _LARGE_GAIN = 4, 1000.0
"""Where some candidate promises so much, every fourth window tells the candidates apart."""
_FINALIST = 1.03
"""Cost over the lowest up to which a candidate is fitted to all windows."""
_FINALISTS = 2
"""So many at most where none explains nearly everything, and the next round tells more."""
_NOISE = 1.15
"""Cost over that of pure noise at which a candidate explains nearly everything."""
_CLOSE = 0.3
"""Share of the best gain from which a candidate is tried although another explains everything, as it may be its twin, or although it takes
shorter steps, and minutes."""
_ROUGHLY = 0.25
"""Part of what it takes to help which a candidate must have done after its rough fit to be fitted further."""
_HOPELESS = 1.2
"""Cost over the lowest of the short list at which a candidate is given up after its rough fit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rival:
    """A candidate after its refit."""

    candidate: Candidate
    fitted: Fitted
    cost: float
    """`whole_cost`."""
    margin: float = 0.0
    """`states_margin`, by which an effect with memory must do better than one without."""

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name

    @property
    def prepared(self) -> Prepared:
        """Its windows, to go on from where it is."""
        return dataclasses.replace(self.fitted.prepared, start=self.fitted.outcome.estimate)

    def bic(self, allowed: Tolerance) -> float:
        """Bayesian information criterion of the tolerant cost and the margin, in chi-square."""
        return 2.0 * (self.cost + self.margin) + float(np.log(allowed.samples.sum())) * self.fitted.unknowns


def short_listed(scored: Scored, allowed: Tolerance, progress: Progress, tried: Tried) -> list[Rival]:
    """The short list, each fitted in full as long as it is in the running; best first.

    Every candidate is first fitted in short, where the misfit is large to a part of the windows, and only the best to the end and to all;
    the rest of the list has its turn where nothing becomes of these.
    """
    thin, given_up = _thinned(scored, allowed), set[str]()
    while heats := _heats(thin, scored, progress, tried):
        near = _near(heats, thin)
        if finals := _in_full(near, thin, scored, allowed, progress, tried):
            others = [rival for rival in heats if all(rival is not one for one in near)]
            return _ranked([*finals, *others] if thin.every == 1 else finals, allowed)
        if given_up.issuperset(rival.name for rival in near):  # what begins from the loops comes back whatever the list holds
            break
        given_up |= {rival.name for rival in near}
        scored = _without(scored, given_up)
    return []


def _without(scored: Scored, names: set[str]) -> Scored:
    """As if these effects were on no list."""
    kept = [candidate for candidate in scored.found if candidate.name not in names]
    significant = {key: candidate for key, candidate in scored.significant.items() if candidate.name not in names}
    return dataclasses.replace(scored, found=kept, significant=significant)


def _near(heats: list[Rival], thin: "_Thinned") -> list[Rival]:
    """The best of the heats and those that come near it; two at most where none explains nearly everything."""
    near = [rival for rival in heats if rival.cost <= _FINALIST * heats[0].cost + 100.0]
    return near[:_FINALISTS] if min(rival.cost for rival in near) > _NOISE * thin.allowed.noise else near


def _in_full(near: list[Rival], thin: "_Thinned", scored: Scored, allowed: Tolerance, progress: Progress, tried: Tried) -> list[Rival]:
    """These fitted to the end and to all windows, but for what cannot be integrated, is given up, or rings by itself."""
    finals, lowest = [], np.inf

    def fit(rival: Rival, limit: float) -> Fitted | None:
        progress(f"fitting {rival.name} to all records")
        start = rival.prepared if thin.every == 1 else _with_all_windows(scored, rival)
        fitted = fit_tolerantly(start, allowed, give_up_above=limit)
        return None if fitted is None else better_placed(fitted, scored.known, allowed)

    for rival in near:
        limit = _HOPELESS * lowest
        fitted = tried.fitted(scored.fitted, ("in full", *_key(thin, rival.candidate)), limit, partial(fit, rival, limit))
        if fitted is not None and not rings_by_itself(fitted, scored.courses):
            finals.append(rival_of(rival.candidate, fitted, allowed))
            lowest = min(lowest, finals[-1].cost)
    return finals


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Thinned:
    """Every so manieth window; two neighbours at a time."""

    every: int
    chosen: np.ndarray
    allowed: Tolerance
    hopeless: float
    """Cost above which a candidate is given up after its rough fit."""


def _thinned(scored: Scored, allowed: Tolerance) -> _Thinned:
    """A part of the windows that suffices to tell large gains apart."""
    best = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    every = _EVERY if best > _LARGE_GAIN and len(allowed.samples) > 16 * _EVERY else 1
    windows = np.arange(len(allowed.samples))
    chosen = windows[windows % (2 * every) < 2] if every > 1 else windows
    thin = dataclasses.replace(allowed, samples=allowed.samples[chosen])
    before = thin.total(scored.fitted.outcome.equations.cost[chosen])
    hopeless = before - _ROUGHLY * HELPS * max(before - thin.noise, 0.0)
    return _Thinned(every=every, chosen=chosen, allowed=thin, hopeless=hopeless)


def _heats(thin: _Thinned, scored: Scored, progress: Progress, tried: Tried) -> list[Rival]:
    """The short list, fitted in short to the chosen windows; best first."""
    best = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    short = [_startable(one, scored) for one in scored.significant.values() if one.gain >= _WORTH_A_TRY * best][:_SHORT_LIST]
    rivals: list[Rival] = []

    def explained() -> bool:
        return any(rival.cost < _NOISE * thin.allowed.noise for rival in rivals)

    queue = [*with_other_starts(short, scored), *beyond_scores(scored, short)]
    with ThreadPoolExecutor(1) as ahead:
        for candidate, following in zip(queue, [*queue[1:], None], strict=True):
            prepared = extended(scored.fitted, candidate, scored.courses)
            if candidate.gain < _CLOSE * best and (explained() or takes_long(prepared, scored.fitted)):
                continue
            if following and following.name != candidate.name and (following.gain >= _CLOSE * best or (rivals and not explained())):
                ahead.submit(_compiled, thin, scored, following, tried)
            newest = "" if candidate.members[0].is_stop else candidate.name
            rivals += _heat(thin, scored, candidate, prepared, rivals, progress, tried, newest=newest)
    if not explained() and _resist(scored):
        for candidate, prepared in from_loops(scored):
            rivals += _heat(thin, scored, candidate, prepared, rivals, progress, tried)
    leading: dict[str, Rival] = {}
    for rival in _ranked(rivals, thin.allowed):
        leading.setdefault(f"{rival.name} {rival.candidate.members[0].channel or ''}", rival)
    return list(leading.values())


def _compiled(thin: _Thinned, scored: Scored, candidate: Candidate, tried: Tried) -> None:
    """Evaluated once, so that its program is there when its turn comes: one core compiles while the others fit."""
    if tried.has(scored.fitted, _key(thin, candidate)):
        return
    prepared = windows_of(extended(scored.fitted, candidate, scored.courses), thin.chosen)
    if not takes_long(prepared, scored.fitted):
        evaluator(prepared, integrator_for(prepared))(prepared.start)


def _heat(
    thin: _Thinned,
    scored: Scored,
    candidate: Candidate,
    prepared: Prepared,
    before: list[Rival],
    progress: Progress,
    tried: Tried,
    *,
    newest: str = "",
) -> list[Rival]:
    """One candidate, fitted in short; empty where it cannot be integrated, is given up beside those `before` it, or rings by itself."""
    lowest = min((rival.cost for rival in before), default=np.inf)
    limit = min(thin.hopeless, max(_HOPELESS * lowest, lowest + 100.0))

    def fit() -> Fitted | None:
        progress(f"trying {candidate.name} {candidate.members[0].channel or ''} beside {scored.fitted.title}")
        found = fit_tolerantly(windows_of(prepared, thin.chosen), thin.allowed, newest=newest, give_up_above=limit, in_short=True)
        if found is None or not rings_by_itself(found, scored.courses):
            return found
        further = dataclasses.replace(found.prepared, start=found.outcome.estimate)
        return fit_tolerantly(further, thin.allowed, give_up_above=limit)  # it may be on its way

    fitted = tried.fitted(scored.fitted, _key(thin, candidate), limit, fit)
    return [] if fitted is None or rings_by_itself(fitted, scored.courses) else [rival_of(candidate, fitted, thin.allowed)]


def _key(thin: _Thinned, candidate: Candidate) -> tuple[int, tuple[AbstractEffect, ...]]:
    """What tells one fit beside a model from another."""
    return thin.every, candidate.members


def takes_long(prepared: Prepared, beside: Fitted) -> bool:
    """Whether a vibration of the newest effect's own is much faster than what the model follows without it."""
    without = integrator_for(dataclasses.replace(beside.prepared, model=beside.model))
    return bool(integrator_for(prepared).flight_step < 0.5 * without.flight_step)


def with_other_starts(short: list[Candidate], scored: Scored) -> list[Candidate]:
    """The short list, with as many probes of each effect as it wants to be tried from."""
    found = []
    for candidate in short:
        others = [one for one in scored.found if one.name == candidate.name and 0.0 < one.gain < candidate.gain]
        found += [candidate, *others[: candidate.members[0].tries - 1]]
    return found


def rival_of(candidate: Candidate, fitted: Fitted, allowed: Tolerance) -> Rival:
    """The candidate as it has been fitted, with its cost."""
    return Rival(candidate=candidate, fitted=fitted, cost=whole_cost(fitted, allowed), margin=states_margin(fitted))


def _ranked(rivals: list[Rival], allowed: Tolerance) -> list[Rival]:
    """By cost with the price of every estimated number."""
    return sorted(rivals, key=lambda rival: rival.bic(allowed))


def _with_all_windows(scored: Scored, rival: Rival) -> Prepared:
    """All windows, from what the fit to a part of them found."""
    whole = extended(scored.fitted, rival.candidate, scored.courses)
    found = rival.fitted.outcome.estimate
    return dataclasses.replace(whole, start=dataclasses.replace(whole.start, shared=found.shared, nuisances=found.nuisances))


def beyond_scores(scored: Scored, short: list[Candidate]) -> list[Candidate]:
    """What is tried without a score: stops, of which no derivative tells anything, where windows resist; and what the records show."""
    listed, probes = {one.name for one in short}, [one.members for one in short]
    stops = [one for one in scored.found if one.members[0].is_stop and one.name not in listed] if _resist(scored) else []
    shown = [one for one in scored.found if one.members[0].shown_by(scored.known) and one.members not in probes]
    return [_startable(one, scored) for one in [*stops[:_STOPS], *shown]]


def _resist(scored: Scored) -> bool:
    """Whether some windows are fitted far worse than most, as where impacts are."""
    cost = scored.fitted.outcome.equations.cost
    resisting = float(np.mean(cost > 2.0 * np.median(cost) + 100.0))
    return resisting >= 0.02 and not scored.fitted.prepared.experiment.only_decays


def _startable(candidate: Candidate, scored: Scored) -> Candidate:
    """A stop starts as it was proposed, and so does what the records show: along a motion without it no derivative tells its strength."""
    effect = candidate.members[0]
    as_proposed = effect.is_stop or effect.shown_by(scored.known)
    return dataclasses.replace(candidate, factors=np.ones(len(candidate.members))) if as_proposed else candidate
