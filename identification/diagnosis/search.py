"""Forward selection of effects: a look, the best few with variances estimated anew, the best of these refitted; until nothing is left."""

import dataclasses
from collections.abc import Callable, Collection

import numpy as np

from identification.diagnosis.augment import augmented, without
from identification.diagnosis.decide import LEVEL
from identification.diagnosis.look import Candidate, Look, Scored, best_of_each, look, weighed_anew
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted, fit
from vibrojax.effects import EFFECTS
from vibrojax.errors import NoConvergenceError

_WEIGHED = 6
"""Candidates of a look of which the variances are estimated anew."""
_REFITTED = 4
"""Of these, refitted where a large random force hides the order of the scores."""
LARGE_FORCE = 0.05
"""Random force, over the force of the suspension, above which scores do not order candidates."""
MOST_EFFECTS = 3
Progress = Callable[[str], None]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Alternative:
    """A candidate of one step.

    Attributes:
        candidate: effect and signals.
        expected: gain of twice the log likelihood by the score.
        gain: the same with all variances estimated anew, at first order.
        degrees, tried: numbers that it adds, and candidates among which it is the best.
        fitted: the model with it, iterated to the end; None where it was not.
        drop: gain after that.
    """

    candidate: Candidate
    expected: float
    gain: float
    degrees: int
    tried: int
    fitted: Fitted | None = None
    drop: float | None = None

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name

    @property
    def best(self) -> float:
        """Gain by the best that is known of it."""
        return self.gain if self.drop is None else self.drop

    def criterion(self, samples: int) -> float:
        """Bayesian information criterion, less that of the model without it; the lower the better (Schwarz 1978)."""
        return self.degrees * float(np.log(max(samples, 1))) - self.best


@dataclasses.dataclass(frozen=True, kw_only=True)
class Step:
    """A look beside one model, and what came of its candidates, the best first; empty where none was significant."""

    look: Look
    alternatives: tuple[Alternative, ...]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Search:
    """Course of a search.

    Attributes:
        nominal: fitted.
        final: the last model whose gain is significant.
        steps: by effect taken in, in order.
        last: step beside the final model, in which nothing was significant.
        finished: whether it came to its end before its budget did.
    """

    nominal: Fitted
    final: Fitted
    steps: tuple[Step, ...]
    last: Step | None
    finished: bool


def search(
    nominal: Fitted,
    among: Collection[str] = EFFECTS,
    *,
    progress: Progress = lambda line: None,
    spent: Callable[[], bool] = lambda: False,
) -> Search:
    """Take in effects one by one as long as the likelihood asks for one; then ask of each of several whether it is still needed.

    Args:
        nominal: fitted.
        among: names of the effects that are looked for.
        progress: called with a line at each stage.
        spent: whether the budget has been used up; the search then ends with what it has.
    """
    current, steps = nominal, []
    while True:
        progress(f"looking at everything that may be missing{_beside(current)}")
        step = _step(look(current, among), progress)
        fitted = step.alternatives[0].fitted if step.alternatives else None
        if fitted is None or not is_significant(step.alternatives[0]):
            return _needed(Search(nominal=nominal, final=current, steps=tuple(steps), last=step, finished=True), progress)
        steps.append(step)
        current = fitted
        if len(steps) == MOST_EFFECTS or spent():
            return Search(nominal=nominal, final=current, steps=tuple(steps), last=None, finished=len(steps) == MOST_EFFECTS)


def is_significant(one: Alternative) -> bool:
    """Whether noise alone gives a gain like that of an alternative by less than the level."""
    return chance(one.best, one.degrees, one.tried) < LEVEL


def _step(seen: Look, progress: Progress) -> Step:
    """Weigh the best candidates anew and refit those that may be the best."""
    base = weighed_anew(seen, None).deviance
    tried = len(seen.listed)
    found: list[tuple[Alternative, Reestimated]] = []
    for scored in _shortlist(seen):
        weighed = weighed_anew(seen, scored.candidate)
        one = Alternative(
            candidate=scored.candidate,
            expected=scored.gain,
            gain=base - weighed.deviance,
            degrees=_numbers(scored.candidate, len(seen.fitted.problem.chains.knots)),
            tried=tried + (scored.candidate.members[0].probe.searched - 1),
        )
        found.append((one, weighed))
    found.sort(key=lambda pair: -pair[0].gain)
    promising = [pair for pair in found if is_significant(pair[0])]
    refitted, samples = [], seen.fitted.local.samples
    for rank, (one, weighed) in enumerate(promising):
        best = max((other.best for other in refitted), default=0.0)
        hidden = _force(seen.fitted, promising[0][1]) > LARGE_FORCE
        if rank and not (hidden and rank < _REFITTED) and one.gain < 0.5 * best:
            continue
        special = [other for other, _ in promising if other.name in one.candidate.members[0].special_cases]
        if any(other.criterion(samples) <= one.criterion(samples) for other in special):
            continue
        progress(f"fitting the model with {one.name}{_beside(seen.fitted)}")
        try:
            fitted = augmented(seen, one.candidate, weighed.strengths, progress=progress)
        except (np.linalg.LinAlgError, NoConvergenceError):  # a wrong effect may leave no model that can be integrated
            continue
        refitted.append(dataclasses.replace(one, fitted=fitted, drop=seen.fitted.solution.deviance - fitted.solution.deviance))
    done = {one.candidate.key for one in refitted}
    others = [one for one, _ in found if one.candidate.key not in done]
    return Step(look=seen, alternatives=(*sorted(refitted, key=lambda one: one.criterion(samples)), *others))


def _numbers(candidate: Candidate, records: int) -> int:
    """Numbers that an effect adds to the model, those of its grid left out."""
    parameters = [p for p in candidate.members[0].parameters if not p.searched]
    return sum(records if p.per_record else 1 for p in parameters)


def _shortlist(seen: Look) -> list[Scored]:
    """The best of each kind by score; where scores do not order, stops too, which the motion without them passes through."""
    best = list(best_of_each(seen.listed).values())
    chosen = best[:_WEIGHED]
    if seen.fitted.variances.force.std > LARGE_FORCE * seen.fitted.problem.scales.force:
        chosen += [one for one in best[_WEIGHED:] if one.candidate.members[0].probe.is_stop]
    return [one for one in chosen if one.gain > 0.0]


def _force(fitted: Fitted, weighed: Reestimated) -> float:
    """Random force that the best candidate leaves, over the force of the suspension."""
    return weighed.variances.force.std / fitted.problem.scales.force


def _needed(found: Search, progress: Progress) -> Search:
    """The search without the effects that the others have made needless."""
    final, steps = found.final, list(found.steps)
    for step in found.steps[:-1]:
        name = step.alternatives[0].name
        if len(steps) < 2:
            break
        progress(f"asking whether {name} is still needed")
        lesser = fit(without(final, name), both=False, together=False, progress=progress)
        rise = lesser.solution.deviance - final.solution.deviance
        if chance(rise, step.alternatives[0].degrees, step.alternatives[0].tried) > LEVEL and lesser.converged:
            final, steps = lesser, [one for one in steps if one is not step]
    return dataclasses.replace(found, final=final, steps=tuple(steps))


def _beside(fitted: Fitted) -> str:
    names = [effect.name for effect in fitted.problem.model.effects]
    return f" beside {', '.join(names)}" if names else ""
