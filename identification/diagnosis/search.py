"""Forward selection of effects, one in each step, until no candidate is significant.

A step scores all candidates, estimates all variances anew with the best few of them, and refits the best of these. A value in each record,
of parameters in which the records contradict each other, competes with the effects.
"""

import dataclasses
from collections.abc import Collection, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from identification.diagnosis.augment import aligned, augmented, is_shown_late, misalignment_of, only_by_force, refitted, without
from identification.diagnosis.decide import LEVEL
from identification.diagnosis.next_experiment import Cause
from identification.diagnosis.scatter import contradicted, gain_of_values, if_still_needed, with_values
from identification.diagnosis.scores import Candidate, Scored, Scores, all_weighed_anew, best_of_each, hides_the_order, score_all
from identification.estimation.parameters import variations
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted, Progress
from vibrojax.effects import EFFECTS
from vibrojax.effects.formula import Formula
from vibrojax.errors import NoConvergenceError

_WEIGHED = 6
"""Candidates with which all variances are estimated anew in one step, at most."""
_WORTH_WEIGHING = 0.05
"""Score over the best one, from which a candidate is weighed: while physics is missing, scores are up to six times too small."""
_WORTH_FITTING = 0.05
"""Chance by which noise gives a gain at first order, below which a candidate is refitted."""
MOST_EFFECTS = 3


@runtime_checkable
class Judging(Protocol):
    """Asks an alternative beside a model."""

    def with_held_back(self, before: Fitted, one: "Alternative") -> "Alternative":
        """With its gain on the records held back."""
        ...

    def __call__(self, before: Fitted, one: "Alternative", no_worse_than: Fitted | None = None) -> "Alternative":
        """With the reason why it is not taken in; it may raise the error left out up to that of a further model, where given."""
        ...

    def errors(self, before: Fitted, after: Fitted) -> tuple[float, float]:
        """Of two models on what was left out."""
        ...


class OutOfBudgetError(Exception):
    """Raised by a caller's `progress` to end a search where it stands."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Alternative:
    """A candidate of one step.

    Attributes:
        candidate: effect and signals.
        gain: of twice the log likelihood with all variances estimated anew, at first order.
        degrees, tried: numbers that it adds, and candidates among which it is the best.
        fitted: the model with it, iterated to the end; None where it was not.
        drop: gain after that.
        held_back: gain on records that no fit has seen; 0 where there are none.
        refused: why it is not taken in; empty where it may be.
        errors: without and with it on what was left out; None where they were not asked.
        cause: the fitted model without its equations, of one that was not taken in; else None.
    """

    candidate: Candidate
    gain: float
    degrees: int
    tried: int
    fitted: Fitted | None = None
    drop: float | None = None
    held_back: float = 0.0
    refused: str = ""
    errors: tuple[float, float] | None = None
    cause: Cause | None = None

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name

    @property
    def best(self) -> float:
        """Gain by the best that is known of it, over all records."""
        return self.fitted_gain + self.held_back

    @property
    def fitted_gain(self) -> float:
        """The same over the records that were fitted."""
        return self.gain if self.drop is None else self.drop

    @property
    def raises_error(self) -> bool:
        """Whether the error on what was left out is larger with it."""
        return self.errors is not None and _is_worse(self.errors)

    def criterion(self, samples: int) -> float:
        """Bayesian information criterion, less that of the model without it; the lower the better (Schwarz 1978)."""
        return self.degrees * float(np.log(max(samples, 1))) - self.best


@dataclasses.dataclass(frozen=True, kw_only=True)
class Step:
    """Candidates scored beside one model, and what came of them.

    Attributes:
        scores: beside the model.
        alternatives: that may be taken in, the best first; the first one is, where its gain is significant.
        refused: that were fitted and are significant, and were not taken in.
        finished: whether every candidate that could be the best was fitted.
        beside_later: alternatives to the first one beside the effects that were taken in after it; empty where it was not asked again.
    """

    scores: Scores
    alternatives: tuple[Alternative, ...]
    refused: tuple[Alternative, ...] = ()
    finished: bool = True
    beside_later: tuple[Alternative, ...] = ()


@dataclasses.dataclass(frozen=True, kw_only=True)
class Search:
    """Course of a search.

    Attributes:
        nominal: fitted.
        final: the last model whose gain is significant.
        steps: by effect taken in, in order.
        last: step beside the final model, in which no effect was taken in.
        finished: whether it came to its end before its budget did.
        first: scores beside the nominal model.
    """

    nominal: Fitted
    final: Fitted
    steps: tuple[Step, ...]
    last: Step | None
    finished: bool
    first: Scores | None = None


def search(
    nominal: Fitted,
    among: Collection[str] = EFFECTS,
    *,
    terms: Sequence[Formula] = (),
    judge: Judging,
    progress: Progress = lambda line: None,
) -> Search:
    """Take in effects one by one as long as the likelihood asks for one; then ask of each of several whether it is needed, and the best.

    Where one was not, begin again beside the others. In the first pass an effect may raise the error on what was left out, up to that of
    the nominal model: beside one that only comes close to what is missing, a true one does; beside the largest random force by any amount.
    If the search then has a larger error than before that effect, it goes back to the model without it and allows no rise.

    Parameters in which records contradict each other get a value in each where that says more than any effect, or none is asked for.

    Args:
        nominal: fitted.
        among: names of the effects that are looked for.
        terms: those of the user; of these, too, the ones that `among` names.
        judge: says why an alternative is not taken in; the next one is then asked.
        progress: called with a line at each stage and round of a fit; where it raises `OutOfBudgetError`, the search ends with what it has.
    """
    found = Search(nominal=nominal, final=nominal, steps=(), last=None, finished=True)
    for turn in range(MOST_EFFECTS):
        found = _forward(found, among, terms, judge, progress, may_rise=turn == 0)
        if not found.finished:
            return found
        names, earlier = _names(found), _before_the_error_rose(found) if turn == 0 else None
        try:
            found = _needed(found, among, terms, judge, progress)
            if earlier is not None and _is_worse(judge.errors(earlier.final, found.final)):
                found, names = earlier, None
                progress(f"searching again{_beside(found.final)}, where the error was smaller")
        except OutOfBudgetError:
            return dataclasses.replace(found, finished=False)
        if _names(found) == names:
            break
    return found if variations(found.final.problem) else dataclasses.replace(found, nominal=nominal)


def _is_worse(errors: tuple[float, float]) -> bool:
    """Whether the second of two errors is the larger one."""
    return errors[1] > errors[0]


def _before_the_error_rose(found: Search) -> Search | None:
    """The search up to the first effect that raised the error on what was left out; None without such an effect."""
    for place, step in enumerate(found.steps):
        if step.alternatives[0].raises_error:
            return dataclasses.replace(found, final=step.scores.fitted, steps=found.steps[:place], last=None)
    return None


def _forward(
    found: Search, among: Collection[str], terms: Sequence[Formula], judge: Judging, progress: Progress, *, may_rise: bool
) -> Search:
    """The search with effects taken in one by one, or values in each record, until nothing is asked for, or a free form says more."""
    try:
        while len(found.steps) < MOST_EFFECTS and found.last is None and found.finished:
            progress(f"scoring all candidates{_beside(found.final)}")
            scores = score_all(found.final, among, terms)
            found = found if found.steps else dataclasses.replace(found, first=scores)
            weighed, names = _weighed(scores), contradicted(found.final)
            step = None
            if names and weighed and hides_the_order(scores.fitted, weighed[0][1].variances):  # then gains at first order compare nothing
                step = _step(scores, weighed, judge, progress, no_worse_than=found.nominal if may_rise else None)
            if names and (step is not None or _says_more(scores, names, weighed)):
                varied, step = _with_values_beside(step, found.final, names, progress)
                if varied is not None and not (step is not None and _is_likelier(step, varied)):
                    found = _beside_values(found, varied)
                    continue
                names = ()
            step = step or _step(scores, weighed, judge, progress, no_worse_than=found.nominal if may_rise else None)
            taken = _taken(step)
            if taken is not None and step.alternatives[0].candidate.form is None:
                found = dataclasses.replace(found, final=taken, steps=(*found.steps, step), finished=step.finished)
            elif taken is None and names and step.finished and (varied := with_values(found.final, names, progress)) is not None:
                found = _beside_values(found, varied)
            else:
                found = dataclasses.replace(found, last=step, finished=step.finished)
    except OutOfBudgetError:
        return dataclasses.replace(found, finished=False)
    return found


def _names(found: Search) -> list[str]:
    """Of the effects taken in."""
    return sorted(step.alternatives[0].name for step in found.steps)


def _taken(step: Step) -> Fitted | None:
    """The model with what a step takes in; None where it takes nothing in."""
    return step.alternatives[0].fitted if step.alternatives and is_significant(step.alternatives[0]) else None


def _with_values_beside(step: Step | None, model: Fitted, names: tuple[str, ...], progress: Progress) -> tuple[Fitted | None, Step | None]:
    """`with_values`, and the step that was made before it, which is unfinished where the budget ends in between."""
    if step is None:
        return with_values(model, names, progress), None
    try:
        return (with_values(model, names, progress) if step.finished else None), step
    except OutOfBudgetError:
        return None, dataclasses.replace(step, finished=False)


def _is_likelier(step: Step, varied: Fitted) -> bool:
    """Whether what a step takes in is likelier than a model with values in each record, by the information criterion.

    Both are fitted, and compared on the records that were fitted. A likelihood that only the largest random force brings is none.
    """
    if _taken(step) is None:
        return False
    before, best, price = step.scores.fitted, step.alternatives[0], np.log(max(step.scores.fitted.local.samples, 1))
    gain = 0.0 if only_by_force(varied, before) else before.deviance - varied.deviance
    return bool(best.fitted_gain - price * best.degrees > gain - price * len(variations(varied.problem)))


def _beside_values(found: Search, varied: Fitted) -> Search:
    """The search that goes on beside values in each record, which the nominal model has too unless effects came first."""
    return dataclasses.replace(found, final=varied, nominal=found.nominal if found.steps else varied)


def is_significant(one: Alternative) -> bool:
    """Whether noise alone gives a gain like that of an alternative by less than the level."""
    return chance(one.best, one.degrees, one.tried) < LEVEL


def is_twin(one: Alternative, best: Alternative, samples: int) -> bool:
    """Whether chance alone could have put the best before an alternative."""
    return bool(one.criterion(samples) - best.criterion(samples) < -2.0 * np.log(LEVEL))


def _says_more(scores: Scores, names: tuple[str, ...], weighed: list[tuple[Alternative, Reestimated]]) -> bool:
    """Whether a value of some parameters in each record says more than every candidate, by the information criterion at first order."""
    samples = scores.fitted.local.samples
    gain, degrees = gain_of_values(scores.fitted, names)
    best = min((one.criterion(samples) for one, _ in weighed), default=0.0)
    return chance(gain, degrees, 1) < LEVEL and bool(degrees * np.log(samples) - gain < best)


def _step(
    scores: Scores,
    found: list[tuple[Alternative, Reestimated]],
    judge: Judging,
    progress: Progress,
    *,
    known: tuple[Alternative, ...] = (),
    no_worse_than: Fitted | None = None,
) -> Step:
    """Refit the candidates, weighed anew, that may be the best, until one of these is taken in; `known` are fitted already."""
    finished, fitted_before = True, list(known)
    found = [pair for pair in found if all(pair[0].candidate.key != one.candidate.key for one in known)]
    hidden = was_hidden = bool(found) and hides_the_order(scores.fitted, found[0][1].variances)
    waiting = [pair for pair in found if _is_worth_fitting(scores, pair[0], hidden)]
    if hidden:
        waiting.sort(key=lambda pair: (not _is_shown(scores, pair[0].candidate), misalignment_of(scores, pair[0].candidate)))
    samples = scores.fitted.local.samples
    asked: list[Alternative] = []
    while (waiting or fitted_before) and finished and not any(_is_taken(one) for one in asked):
        tried, fitted_before = fitted_before, []
        hidden = hidden and all(_still_hides(other.fitted) for other in tried)
        waiting = [pair for pair in waiting if _is_worth_fitting(scores, pair[0], hidden)]
        try:
            for one, weighed in list(waiting):
                best = max((other.gain if was_hidden else max(other.gain, other.best) for other in tried), default=0.0)
                contained = {name for other in tried for name in other.candidate.members[0].special_cases}
                if is_shown_late(scores, one.candidate):  # of two channels either may be the late one
                    contained |= {other.name for other in tried}
                if not hidden and one.gain < 0.5 * best and one.name not in contained:
                    continue
                waiting.remove((one, weighed))
                if not _special_case_is_as_good(one, [*known, *(other for other, _ in found)], asked, samples):
                    progress(f"fitting the model with {one.name}{_beside(scores.fitted)}")
                    tried += _refitted(scores, one, weighed, progress)
                hidden = hidden and all(_still_hides(other.fitted) for other in tried)
        except OutOfBudgetError:
            finished = False
        asked += _judged(scores.fitted, tried, judge, samples, no_worse_than)
    asked.sort(key=_is_taken, reverse=True)
    refused = [one for one in asked if one.refused and is_significant(one)]
    kept = [one for one in asked if not any(one is other for other in refused)]
    done = {one.candidate.key for one in asked}
    others = [one for one, _ in found if one.candidate.key not in done]
    without_equations = [tuple(map(_without_equations, part)) for part in (kept[1:], refused)]
    return Step(scores=scores, alternatives=(*kept[:1], *without_equations[0], *others), refused=without_equations[1], finished=finished)


def _is_worth_fitting(scores: Scores, one: Alternative, hidden: bool) -> bool:
    """Whether chance hardly gives the gain at first order, or that says little: where gains do not order candidates, of some of these."""
    likely = chance(one.best, one.degrees, one.tried) < _WORTH_FITTING
    return likely or (hidden and (_is_stop(one.candidate) or _is_shown(scores, one.candidate)))


def _without_equations(one: Alternative) -> Alternative:
    """An alternative of whose fit, where it has converged, the model alone is kept."""
    cause = Cause.of(one.fitted) if one.fitted is not None and one.fitted.converged else None
    return dataclasses.replace(one, fitted=None, cause=cause)


def _judged(
    model: Fitted, tried: list[Alternative], judge: Judging, samples: int, no_worse_than: Fitted | None = None
) -> list[Alternative]:
    """Fitted alternatives, the best first, asked until one is taken in; of the others those that chance could have put first.

    One of these that raises no error comes before a best one that does.
    """
    ranked, asked, taken = _ranked([judge.with_held_back(model, one) for one in tried], samples), [], []
    for one in ranked:
        if one.best > 0.0 and (not taken or is_twin(one, taken[0], samples)):
            one = judge(model, one, None if taken else no_worse_than)
            taken += [one] if _is_taken(one) else []
        asked.append(one)
    first = sorted(taken, key=lambda one: one.raises_error)[:1]
    return [*first, *(one for one in asked if all(one is not other for other in first))]


def _still_hides(fitted: Fitted | None) -> bool:
    """Whether a model leaves as much random as would hide the order of candidates."""
    return fitted is None or hides_the_order(fitted, fitted.variances)


def _is_taken(one: Alternative) -> bool:
    """Whether an alternative that was judged is taken in."""
    return not one.refused and is_significant(one)


def _weighed(scores: Scores) -> list[tuple[Alternative, Reestimated]]:
    """The best candidates with all variances estimated anew, by decreasing gain; what the records show counts even where it cannot be."""
    shortlist, found = [aligned(scores, one) for one in _shortlist(scores)], []
    for scored, weighed in zip(shortlist, all_weighed_anew(scores, shortlist), strict=True):
        weighed = weighed or (scores.alone if _is_shown(scores, scored.candidate) else None)
        if weighed is None:
            continue
        one = Alternative(
            candidate=scored.candidate,
            gain=scores.deviance - weighed.deviance,
            degrees=_numbers(scored.candidate, len(scores.fitted.problem.chains.knots)),
            tried=scored.candidate.members[0].probe.tried(scores.scales, len(scores.listed)),
        )
        found.append((one, weighed))
    return sorted(found, key=lambda pair: -pair[0].gain)


def _special_case_is_as_good(one: Alternative, found: list[Alternative], asked: list[Alternative], samples: int) -> bool:
    """Whether an effect of fewer numbers that the alternative contains explains as much, and has not been refused."""
    refused = [other.name for other in asked if other.refused]
    special = [other for other in found if other.name in one.candidate.members[0].special_cases and other.name not in refused]
    return any(is_significant(other) and other.criterion(samples) <= one.criterion(samples) for other in special)


def _ranked(tried: list[Alternative], samples: int) -> list[Alternative]:
    """The best first; before it a special case of it that the records do not reject, and before a free form what explains as much."""
    ranked = sorted(tried, key=lambda one: one.criterion(samples))
    special = [one for one in ranked if one.name in ranked[0].candidate.members[0].special_cases] if ranked else []
    kept = [one for one in special if chance(ranked[0].best - one.best, max(ranked[0].degrees - one.degrees, 1), 1) > LEVEL]
    ranked = [*kept, *(one for one in ranked if not any(one is other for other in kept))]
    if ranked and ranked[0].candidate.form is not None:
        return sorted(ranked, key=lambda one: one.candidate.form is not None or not is_twin(one, ranked[0], samples))
    return ranked


def _refitted(scores: Scores, one: Alternative, weighed: Reestimated, progress: Progress) -> list[Alternative]:
    """An alternative with its model iterated to the end; none where no such model can be fitted."""
    try:
        fitted = augmented(scores, one.candidate, weighed, progress=progress)
    except (np.linalg.LinAlgError, NoConvergenceError):  # a wrong effect may leave no model that can be integrated
        return []
    drop = scores.fitted.deviance - fitted.deviance
    return [dataclasses.replace(one, fitted=fitted, drop=min(drop, 0.0) if only_by_force(fitted, scores.fitted) else drop)]


def _numbers(candidate: Candidate, records: int) -> int:
    """Numbers that an effect adds to the model, those of its grid left out."""
    parameters = [p for p in candidate.members[0].parameters if not p.searched]
    return sum(records if p.per_record else 1 for p in parameters)


def _shortlist(scores: Scores) -> list[Scored]:
    """The best of each kind by score; where scores do not order, also stops, and what the records show without a model.

    A free form that may be fitted as an effect is one of them: an effect that comes close to it is not the cause.
    """
    best = list(best_of_each([*scores.listed, *(one for one in scores.free if one.candidate.members)]).values())
    chosen = [one for one in best[:_WEIGHED] if one.gain > _WORTH_WEIGHING * best[0].gain]
    if hides_the_order(scores.fitted, scores.fitted.variances):
        shown = best_of_each([one for one in scores.listed if _is_shown(scores, one.candidate)])
        stops = [one for one in best if _is_stop(one.candidate) and one.gain > 0.0]
        chosen = list(({one.candidate.key: one for one in (*chosen, *stops)} | shown).values())
    return chosen


def _is_stop(candidate: Candidate) -> bool:
    """Whether a candidate is a stop, or changes the law of the stop: of such its gain at first order says little."""
    return bool(candidate.members) and (candidate.members[0].probe.is_stop or candidate.members[0].does("stop"))


def _is_shown(scores: Scores, candidate: Candidate) -> bool:
    """Whether the records show a candidate without a fitted model.

    So are a stop that the model lacks, a change of its law by the loops of force over indentation, and what makes a channel late that
    `lags` shows to be late.
    """
    if not candidate.members:
        return False
    effect = candidate.members[0]
    if effect.does("stop"):
        return not scores.fitted.problem.model.has_stop or effect.name in scores.in_loops
    return candidate.channel in scores.scales.lags and effect.does("lateness")


def _needed(found: Search, among: Collection[str], terms: Sequence[Formula], judge: Judging, progress: Progress) -> Search:
    """The search without effects that others have made needless, and with a better one in place of one that was taken in before these.

    One that raised the error on what was left out when it was taken in leaves also where the rule refuses it beside the others.
    An effect that was taken in last has just been found to be needed, and to be the best, unless another was exchanged since.
    """
    final, steps, exchanged = found.final, list(found.steps), False
    for step in found.steps if len(found.steps) > 1 else ():
        one = step.alternatives[0]
        if one.fitted is found.final and not exchanged:
            break
        progress(f"asking whether {one.name} is still needed")
        try:
            lesser = refitted(*without(final, one.name), final, progress)
        except (np.linalg.LinAlgError, NoConvergenceError):  # without it the motion cannot be followed
            continue
        if not lesser.converged or only_by_force(lesser, final):
            continue
        rise = lesser.deviance - final.deviance
        again = judge.with_held_back(lesser, dataclasses.replace(one, fitted=final, gain=rise, drop=rise, held_back=0.0))
        if not is_significant(again) or (one.raises_error and judge(lesser, again).refused):
            final, steps = lesser, [other for other in steps if other is not step]
            continue
        progress(f"scoring what may act in place of {one.name}")
        scores = score_all(lesser, among, terms)
        best = _step(scores, _weighed(scores), judge, progress, known=(again,))
        if not best.finished:
            raise OutOfBudgetError
        winner = best.alternatives[0] if best.alternatives else again
        if _is_taken(winner) and winner.candidate.form is not None and is_twin(winner, again, scores.fitted.local.samples):
            final, steps = lesser, [other for other in steps if other is not step]
            continue
        if winner.fitted is None or winner.fitted is final or not is_twin(winner, again, scores.fitted.local.samples):
            asked_again = dataclasses.replace(step, beside_later=(_without_equations(again), *best.alternatives[1:]))
            steps = [asked_again if other is step else other for other in steps]
        elif _is_taken(winner):
            final, exchanged, steps = winner.fitted, True, [*(other for other in steps if other is not step), best]
    if steps and variations(final.problem) and steps[-1].alternatives[0].fitted is final:  # it may have made values needless
        progress("asking whether records still differ")
        final = if_still_needed(final, progress)
    return dataclasses.replace(found, final=final, steps=tuple(steps), last=found.last if final is found.final else None)


def _beside(fitted: Fitted) -> str:
    names = [effect.name for effect in fitted.problem.model.effects]
    return f" beside {', '.join(names)}" if names else ""
