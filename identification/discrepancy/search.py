"""The search: score everything, refit a short list, keep the best, and look again."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from identification.adequacy import OVERALL, chi2_limit
from identification.discrepancy.colour import overstatement
from identification.discrepancy.continuity import continuity_cost, jump_variance
from identification.discrepancy.drift import Drift
from identification.discrepancy.evidence import FALSE_ALARM, chance, significant, trials
from identification.discrepancy.facts import facts
from identification.discrepancy.linearised import Linearised, linearised
from identification.discrepancy.refit import Fitted, extended, windows_of
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate, projector, score
from identification.discrepancy.signature import Course, courses
from identification.discrepancy.tolerant_fit import fit_tolerantly, fitted_from, settled_like
from identification.fit import free_unknowns, integrator_for
from identification.prepare import Prepared
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
EXPLAINED, HELPLESS, MOST_EFFECTS, BUDGET = "explained", "no further effect helps", "as many effects as are tried", "budget"
"""Why a search ended."""
_SHORT_LIST = 6
_WORTH_A_TRY = 0.1
"""Share of the best gain that a candidate must promise to be refitted."""
_MOST_EFFECTS = 3
_STOPS = 3
"""Stops that are tried without a score."""
_EVERY, _LARGE_GAIN = 4, 1000.0
"""Where some candidate promises so much, every fourth window tells the candidates apart."""
_FINALIST = 1.03
"""Cost over the lowest up to which a candidate is fitted to all windows."""
_NOISE = 1.15
"""Cost over that of pure noise at which a candidate explains nearly everything."""
_CLOSE = 0.3
"""Share of the best gain from which a candidate is tried although another explains everything, as it may be its twin, or although it takes
shorter steps, and minutes."""
_HELPS = 0.1
"""Share of the misfit below which a refit has not helped."""
_BETTER = 8.0
"""Drop of the cost, half chi-square, below which a model fitted anew is no other."""
_ROUGHLY = 0.25
"""Part of that which a candidate must have done after its rough fit to be fitted further."""
_ASTRAY, _LEAST_ASTRAY = 0.02, 25.0
"""Share of the windows that may have settled wrongly without a verdict being drawn from them, and the misfit that tells them."""
_JUMP = 10.0
"""Mean squared jump of an effect's own states, in standard errors, above which it has not been followed but chosen anew by each window."""
_REST = 0.01
"""Share of the first misfit that may be left, because an effect is never modelled to the last digit."""
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
    """Tolerant, of all windows, and of the continuity of the effects' own states."""

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name

    @property
    def prepared(self) -> Prepared:
        """Its windows, to go on from where it is."""
        return dataclasses.replace(self.fitted.prepared, start=self.fitted.outcome.estimate)

    def bic(self, allowed: Tolerance) -> float:
        """Bayesian information criterion of the tolerant cost, in chi-square."""
        return 2.0 * self.cost + float(np.log(allowed.samples.sum())) * self.fitted.unknowns


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
    ended: str
    """`EXPLAINED`, `HELPLESS`, `MOST_EFFECTS` or `BUDGET`."""
    without: tuple[str, ...] = ()
    """Names of effects that were not to be tried."""
    mimics: Drift | None = None
    """A parameter that changes in the course of records, which is what the effects stand in for."""
    doubted: bool = False
    """Whether it takes several effects to explain all, of which one does not hold still."""

    @property
    def first(self) -> Scored:
        """The look at the nominal model."""
        return self.rounds[0].scored if self.rounds else self.last

    @property
    def explained(self) -> bool:
        """Whether nothing but noise is left, or a trifle beside what has been explained, and by a cause."""
        return self.ended == EXPLAINED and self.mimics is None and not self.doubted

    @property
    def stages(self) -> tuple[Fitted, ...]:
        """The model after each round; the last as it was fitted in the end."""
        return (*(one.rivals[0].fitted for one in self.rounds[:-1]), self.fitted) if self.rounds else ()

    def share(self, fitted: Fitted, allowed: Tolerance) -> float:
        """Of the first misfit beyond noise, what the effects of one of the stages explain; there is one at least."""
        first = self.rounds[0]
        torn = continuity_cost(fitted) / max(first.cost - allowed.noise, 1e-300)
        return max(allowed.explained(first.scored.fitted.outcome.equations.cost, fitted.outcome.equations.cost) - torn, 0.0)

    def dispersion(self, allowed: Tolerance) -> float:
        """What is left over what noise alone would leave, 1 where all is explained: differences of cost count so much less."""
        return 1.0 if self.explained else max(1.0, whole_cost(self.fitted, allowed) / allowed.noise)


def search(
    start: Fitted,
    allowed: Tolerance,
    deadline: float,
    progress: Progress = lambda stage: None,
    *,
    begun: tuple[Round, ...] = (),
    without: tuple[str, ...] = (),
) -> Search:
    """Add effects to a model until nothing but noise is left, or none of them helps any more.

    Goes on from the rounds that have `begun`, and does not try the effects that it is to do `without`.
    """
    rounds = [*begun[:-1], *(_to_the_end(one, allowed) for one in begun[-1:])]
    fitted = rounds[-1].rivals[0].fitted if rounds else start
    while True:
        progress(f"scoring all candidates beside {_words(fitted)}")
        scored = look(fitted, allowed, without=without)
        cost = whole_cost(fitted, allowed)
        ended = why_ended(scored, allowed, rounds, deadline)
        rivals = [] if ended else _refitted(scored, allowed, progress)
        anew = fitted_from(fitted, rivals[0].fitted, allowed) if rivals else fitted
        if anew is not fitted and cost - whole_cost(anew, allowed) >= max(_HELPS * (cost - allowed.noise), _BETTER):
            fitted = anew
            continue
        if rivals and (settled := settled_like(fitted, rivals[0].fitted)) is not fitted:
            fitted, cost = settled, min(cost, whole_cost(settled, allowed))
            at = linearised(fitted.prepared, integrator_for(fitted.prepared), fitted.outcome.estimate)
            scored = dataclasses.replace(scored, fitted=fitted, at=at)
        if not ended and not (rivals and _helps(rivals[0], cost, scored, allowed)):
            ended = EXPLAINED if adequate(fitted, allowed) else HELPLESS
        if ended:
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, ended=ended, without=without)
        rounds.append(Round(scored=scored, cost=cost, rivals=tuple(rivals)))
        fitted = rivals[0].fitted


def reopened(one: Round, allowed: Tolerance, *, without: tuple[str, ...]) -> tuple[Round, ...]:
    """The round as it ends without some effects; none where no other one helps."""
    rivals = tuple(rival for rival in one.rivals if rival.name not in without)
    if not rivals or not _helps(rivals[0], one.cost, one.scored, allowed):
        return ()
    return (dataclasses.replace(one, rivals=rivals),)


def _to_the_end(one: Round, allowed: Tolerance) -> Round:
    """The round with its best rival, which may have been fitted in short, fitted in full."""
    best, *others = one.rivals
    fitted = fit_tolerantly(best.prepared, allowed)
    return one if fitted is None else dataclasses.replace(one, rivals=(_rival(best.candidate, fitted, allowed), *others))


def why_ended(scored: Scored, allowed: Tolerance, rounds: list[Round], deadline: float) -> str:
    """Why no further effect is tried; empty where one is."""
    if _explained(scored, allowed, rounds):
        return EXPLAINED
    if not scored.significant and not _beyond_scores(scored, []):
        return EXPLAINED if adequate(scored.fitted, allowed) else HELPLESS
    if len(scored.fitted.names) >= _MOST_EFFECTS:
        return MOST_EFFECTS
    return BUDGET if time.monotonic() > deadline else ""


def _helps(best: Rival, cost: float, scored: Scored, allowed: Tolerance) -> bool:
    """Whether the refit delivers more than noise would, be it coloured, and a fair share of the misfit."""
    drop, misfit = cost - best.cost, cost - allowed.noise
    by_chance = chance(2.0 * drop / _overstated(best.fitted, scored, allowed), best.candidate.degrees, trials(scored.found, best.name))
    return by_chance < FALSE_ALARM and drop >= _HELPS * misfit


def _overstated(fitted: Fitted, scored: Scored, allowed: Tolerance) -> float:
    """Factor that coloured noise puts on the drop of chi-square; 1 where more than noise is left, whose colour is then that of a misfit."""
    if not adequate(fitted, allowed):
        return 1.0
    at = linearised(fitted.prepared, integrator_for(fitted.prepared), fitted.outcome.estimate)
    whole = (at.finite & scored.at.finite)[:, None, None]
    root = np.sqrt(allowed.weights(fitted.outcome.equations.cost))[:, None, None] * whole
    return overstatement(root * scored.at.residual, root * at.residual)


def look(fitted: Fitted, allowed: Tolerance, *, without: tuple[str, ...] = ()) -> Scored:
    """Score every candidate that the model does not have yet, but for those that are not to be tried."""
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    at = linearised(prepared, integrator_for(prepared), estimate)
    along, known = courses(prepared, at, estimate), facts(prepared, at, estimate)
    weights = allowed.weights(fitted.outcome.equations.cost) * at.finite
    by = projector(prepared, at, estimate, free_unknowns(prepared), weights)
    kinds = [kind for name, kind in EFFECTS.items() if name not in (*fitted.names, *without)]
    candidates = [one for kind in kinds for one in blank(kind).probes(known)]
    found = score(prepared, by, along, candidates, known.mass)
    return Scored(fitted=fitted, at=at, courses=along, found=found, significant=significant(found))


def blank(kind: type[AbstractEffect]) -> AbstractEffect:
    """An effect with every parameter at its order of magnitude."""
    usual: dict[str, Any] = {p.field: p.start for p in kind.parameters}
    return kind(**usual)


def _explained(scored: Scored, allowed: Tolerance, rounds: list[Round]) -> bool:
    """Whether what is left is noise, or a trifle beside what has been explained."""
    misfit = whole_cost(scored.fitted, allowed) - allowed.noise
    first = max(rounds[0].cost - allowed.noise, 0.0) if rounds else 0.0
    left = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    return (adequate(scored.fitted, allowed) or misfit < _REST * first) and left <= _REST * 2.0 * first


def adequate(fitted: Fitted, allowed: Tolerance) -> bool:
    """Whether chi-square is that of noise, a few windows apart that have settled on a wrong number of impacts or were lost.

    An effect with memory must also carry it from window to window.
    """
    cost, samples = fitted.outcome.equations.cost, allowed.samples
    told = samples > 0
    x = np.where(np.isfinite(cost) & told, 2.0 * cost, np.inf)[told] / samples[told]
    most = np.isfinite(x) & (x <= max(np.quantile(x, 1.0 - _ASTRAY, method="lower"), _LEAST_ASTRAY))
    free = np.concatenate([np.full(len(group.record), group.prescribed is None) for group in fitted.prepared.groups])
    degrees = int(samples[told][most].sum()) - fitted.unknowns - fitted.prepared.layout.states * int(free[told][most].sum())
    if np.mean(~most) > _ASTRAY or degrees <= 0:
        return False
    is_noise = float(2.0 * cost[told][most].sum()) / degrees <= chi2_limit(degrees, OVERALL)
    return is_noise and jump_variance(fitted) <= _JUMP


def _refitted(scored: Scored, allowed: Tolerance, progress: Progress) -> list[Rival]:
    """The short list, each fitted in full as long as it is in the running; best first.

    Every candidate is first fitted in short, where the misfit is large to a part of the windows, and only the best to the end and to all.
    """
    thin = _thinned(scored, allowed)
    heats = _heats(thin, scored, progress)
    near = [rival for rival in heats if rival.cost <= _FINALIST * heats[0].cost + 100.0]
    finals, lowest = [], np.inf
    for rival in near:
        progress(f"fitting {rival.name} to all records")
        start = rival.prepared if thin.every == 1 else _with_all_windows(scored, rival)
        try:
            fitted = fit_tolerantly(start, allowed, give_up_above=_HOPELESS * lowest)
        except NoConvergenceError:
            continue
        if fitted is not None:
            finals.append(_rival(rival.candidate, fitted, allowed))
            lowest = min(lowest, finals[-1].cost)
    others = [rival for rival in heats if rival.cost > _FINALIST * heats[0].cost + 100.0]
    return _ranked([*finals, *others] if thin.every == 1 else finals, allowed)


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
    hopeless = before - _ROUGHLY * _HELPS * max(before - thin.noise, 0.0)
    return _Thinned(every=every, chosen=chosen, allowed=thin, hopeless=hopeless)


def _heats(thin: _Thinned, scored: Scored, progress: Progress) -> list[Rival]:
    """The short list, fitted in short to the chosen windows; best first."""
    best = max((candidate.gain for candidate in scored.significant.values()), default=0.0)
    short = [_startable(one) for one in scored.significant.values() if one.gain >= _WORTH_A_TRY * best][:_SHORT_LIST]
    noise, rivals = thin.allowed.noise, []
    for candidate in [*with_other_starts(short, scored), *_beyond_scores(scored, short)]:
        lowest = min((rival.cost for rival in rivals), default=np.inf)
        prepared = windows_of(extended(scored.fitted, candidate, scored.courses), thin.chosen)
        if candidate.gain < _CLOSE * best and (lowest < _NOISE * noise or takes_long(prepared, scored.fitted)):
            continue
        progress(f"trying {candidate.name} {candidate.members[0].channel or ''} beside {_words(scored.fitted)}")
        try:
            limit = min(thin.hopeless, max(_HOPELESS * lowest, lowest + 100.0))
            newest = "" if candidate.members[0].is_stop else candidate.name
            fitted = fit_tolerantly(prepared, thin.allowed, newest=newest, give_up_above=limit, in_short=True)
        except NoConvergenceError:
            continue
        if fitted is not None:
            rivals.append(_rival(candidate, fitted, thin.allowed))
    leading: dict[str, Rival] = {}
    for rival in _ranked(rivals, thin.allowed):
        leading.setdefault(f"{rival.name} {rival.candidate.members[0].channel or ''}", rival)
    return list(leading.values())


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


def whole_cost(fitted: Fitted, allowed: Tolerance) -> float:
    """Tolerant cost of all windows, and of the continuity of the effects' own states."""
    return allowed.total(fitted.outcome.equations.cost) + continuity_cost(fitted)


def _rival(candidate: Candidate, fitted: Fitted, allowed: Tolerance) -> Rival:
    return Rival(candidate=candidate, fitted=fitted, cost=whole_cost(fitted, allowed))


def _ranked(rivals: list[Rival], allowed: Tolerance) -> list[Rival]:
    """By cost with the price of every estimated number."""
    return sorted(rivals, key=lambda rival: rival.bic(allowed))


def _with_all_windows(scored: Scored, rival: Rival) -> Prepared:
    """All windows, from what the fit to a part of them found."""
    whole = extended(scored.fitted, rival.candidate, scored.courses)
    found = rival.fitted.outcome.estimate
    return dataclasses.replace(whole, start=dataclasses.replace(whole.start, shared=found.shared, nuisances=found.nuisances))


def _beyond_scores(scored: Scored, short: list[Candidate]) -> list[Candidate]:
    """Stops that the nominal motion passes through: no derivative tells what they would do, so they are tried where windows resist."""
    resisting = float(np.mean(scored.fitted.outcome.equations.cost > 2.0 * np.median(scored.fitted.outcome.equations.cost) + 100.0))
    if resisting < 0.02 or scored.fitted.prepared.experiment.only_decays:
        return []
    listed = {candidate.name for candidate in short}
    stops = [one for one in scored.found if one.members[0].is_stop and one.name not in listed]
    return [_startable(one) for one in stops[:_STOPS]]


def _startable(candidate: Candidate) -> Candidate:
    """A stop starts as it was proposed, because a derivative along a motion that passes through it says nothing of its strength."""
    return dataclasses.replace(candidate, factors=np.ones(len(candidate.members))) if candidate.members[0].is_stop else candidate


def _words(fitted: Fitted) -> str:
    return " and ".join(fitted.names) if fitted.names else "the nominal model"
