"""The search: score everything, refit a short list, keep the best, and look again."""

import dataclasses
import time
from collections.abc import Callable

import numpy as np

from identification.adequacy import OVERALL, chi2_limit
from identification.discrepancy.evidence import significant
from identification.discrepancy.facts import facts
from identification.discrepancy.linearised import Linearised, linearised
from identification.discrepancy.refit import Fitted, extended
from identification.discrepancy.robust import Tolerance, tolerance
from identification.discrepancy.score import Candidate, projector, score
from identification.discrepancy.signature import Course, courses
from identification.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.levenberg_marquardt import LevenbergMarquardt, settle
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
_SHORT_LIST = 4
_WORTH_A_TRY = 0.03
"""Share of the best gain that a candidate must promise to be refitted."""
_MOST_EFFECTS = 3
_NO_CUT = np.inf


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
        enough = _explained(fitted, allowed, scored)
        if enough or not scored.significant or len(fitted.names) >= _MOST_EFFECTS or time.monotonic() > deadline:
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, explained=enough)
        rivals = _refitted(scored, allowed, progress)
        rounds.append(Round(scored=scored, cost=cost, rivals=tuple(rivals)))
        if not rivals or cost - rivals[0].cost < _LEAST_GAIN:
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, explained=False)
        fitted = rivals[0].fitted


_LEAST_GAIN = 12.0
"""Drop of the cost (half chi-square) below which a refit has not helped."""


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
    return kind(**{p.field: p.start for p in kind.parameters})


def _explained(fitted: Fitted, allowed: Tolerance, scored: Scored) -> bool:
    """No misfit beyond the noise, overall or along any candidate."""
    degrees = int(allowed.samples.sum()) - fitted.unknowns - fitted.prepared.layout.states * len(allowed.samples)
    return fitted.chi2 / degrees <= chi2_limit(degrees, OVERALL) and not scored.significant


def _refitted(scored: Scored, allowed: Tolerance, progress: Progress) -> list[Rival]:
    """The short list, each fitted in full; best first."""
    best = max(candidate.gain for candidate in scored.significant.values())
    short = [one for one in scored.significant.values() if one.gain >= _WORTH_A_TRY * best][:_SHORT_LIST]
    rivals = []
    for candidate in [*short, *_beyond_scores(scored, short)]:
        progress(f"trying {candidate.name} beside {_words(scored.fitted)}")
        try:
            fitted = tried(scored, candidate, allowed)
        except NoConvergenceError:
            continue
        rivals.append(Rival(candidate=candidate, fitted=fitted, cost=float(allowed.cost(fitted.outcome.equations.cost).sum())))
    return sorted(rivals, key=lambda rival: rival.cost + 0.5 * np.log(allowed.samples.sum()) * rival.fitted.unknowns)


def _beyond_scores(scored: Scored, short: list[Candidate]) -> list[Candidate]:
    """Stops that the nominal motion passes through: no derivative tells what they would do, so they are tried where windows resist."""
    resisting = float(np.mean(scored.fitted.outcome.equations.cost > 2.0 * np.median(scored.fitted.outcome.equations.cost) + 100.0))
    if resisting < 0.02:
        return []
    listed = {candidate.name for candidate in short}
    stops = [one for one in scored.found if one.members[0].back_gap is not None and one.name not in listed]
    return [dataclasses.replace(one, factors=np.ones(len(one.members))) for one in stops[:1]]


def tried(scored: Scored, candidate: Candidate, allowed: Tolerance) -> Fitted:
    """The model with one more effect, fitted tolerantly; windows that resist may settle anew in between."""
    prepared = extended(scored.fitted, candidate, scored.courses)
    return fit_tolerantly(prepared, allowed)


def fit_tolerantly(prepared, allowed: Tolerance) -> Fitted:
    """Everything from `prepared.start`, first roughly, then, after every window has settled anew, to the end."""
    evaluate = evaluator(prepared, integrator_for(prepared))
    tolerant, active, limits = allowed.evaluator(evaluate), free_unknowns(prepared), bounds(prepared)
    rough = LevenbergMarquardt(tolerance=0.5, most_iterations=10)(tolerant, prepared.start, active, limits)
    settled, _ = settle(evaluate, rough.estimate, iterations=3)
    outcome = LevenbergMarquardt(tolerance=0.1, most_iterations=25)(tolerant, settled, active, limits)
    return Fitted(prepared=prepared, outcome=dataclasses.replace(outcome, equations=evaluate(outcome.estimate)))


def no_tolerance(fitted: Fitted) -> Tolerance:
    """Every window counts in full."""
    return dataclasses.replace(tolerance(fitted.prepared, fitted.outcome.equations.cost), cut=_NO_CUT)


def _words(fitted: Fitted) -> str:
    return " and ".join(fitted.names) if fitted.names else "the nominal model"
