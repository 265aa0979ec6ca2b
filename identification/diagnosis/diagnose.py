"""Diagnosis of an experiment: from the fit of the nominal model to a verdict on missing effects."""

import dataclasses
import time
from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from identification.diagnosis.augment import at_first_order, continued, learned
from identification.diagnosis.decide import BEYOND_NOISE, LEVEL, decide
from identification.diagnosis.diagnosis import (
    ADEQUATE,
    MISSING,
    NOT_FINISHED,
    RESTLESS,
    UNDECIDED,
    UNLISTED,
    Asserted,
    Considered,
    Diagnosis,
    Side,
)
from identification.diagnosis.evidence import NOT_CONVERGED, Free, Judge
from identification.diagnosis.left_out import LeftOut, errors_of
from identification.diagnosis.location import locate
from identification.diagnosis.next_experiment import Cause, next_experiment
from identification.diagnosis.scores import Scores, all_weighed_anew, best_of_each, detail, known_effects, limit_warning, score_all
from identification.diagnosis.search import MOST_EFFECTS, Alternative, OutOfBudgetError, Search, Step, is_significant, is_twin, search
from identification.diagnosis.sentences import sentences
from identification.estimation.parameters import between_records, estimates, sensor_errors, uncertainty, unrest
from identification.estimation.prediction import record_fits
from identification.estimation.ring_downs import ring_downs
from identification.experiment import Experiment
from identification.guesses.declared_model import check_clearance, nominal_model
from identification.guesses.fitted_part import in_part
from identification.result.evidence import chance
from identification.result.files import Clock
from identification.result.result import OK, Quantity
from identification.trajectory.fit import Fitted, Progress, fit
from identification.trajectory.start import problem_of
from identification.trajectory.variances import is_largest
from identification.wording.numbers import joined
from vibrojax.effects.base import unit_in
from vibrojax.effects.formula import Formula
from vibrojax.errors import NoConvergenceError

_FORMS = 3
"""Free forms that are weighed anew, the best by score."""
_AT_LIMIT = "the random force beside it is as large as it may be, so that most of the misfit is still unexplained"
_TIME = "the budget ended the search before all was fitted and checked"
_DECIMALS = 4
"""Of a probability."""


class _Course:
    """Lines of progress, up to the end of the budget."""

    def __init__(self, budget_minutes: float, progress: Progress) -> None:
        self.clock, self.progress = Clock(), progress
        self._deadline = time.monotonic() + 60.0 * budget_minutes

    def within_budget(self, line: str) -> None:
        """Pass on the line of a stage or round that begins.

        Raises:
            OutOfBudgetError: the budget has been used up.
        """
        if time.monotonic() > self._deadline:
            raise OutOfBudgetError
        self.progress(line)


def diagnose_experiment(
    experiment: Experiment,
    *,
    law: str | None = None,
    among: Collection[str] | None = None,
    terms: Sequence[Formula] = (),
    budget_minutes: float = 5.0,
    progress: Progress = lambda stage: None,
) -> Diagnosis:
    """Fit the nominal model, search for missing effects and return the verdict; the same records give the same one.

    Arguments:
        experiment: as loaded.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        among: names of the effects that may be added to the model, all listed ones and the terms if left out; `among_effects` checks names.
        terms: of the user, each a candidate like the listed effects.
        budget_minutes: time after which no round of a fit is begun; the verdict is then `UNDECIDED`, with what was found.
        progress: called with a line of text at each stage.

    Raises:
        NoConvergenceError: the nominal model cannot be fitted at all.
    """
    course = _Course(budget_minutes, progress)
    among = tuple(known_effects(terms)) if among is None else among
    check_clearance(experiment, nominal_model(experiment, law).law)
    experiment, partly = in_part(experiment)
    progress("reading first guesses from the records")
    nominal = fit(problem_of(experiment, law=law), progress=progress)
    course.clock.lap("nominal")
    judge = Judge(experiment)
    found = search(nominal, among, terms=terms, judge=judge, progress=course.within_budget)
    last = score_all(found.final, among, terms) if found.last is None else found.last.scores
    course.clock.lap("search")
    progress("predicting what was left out")
    found, left, forms, form, reasons, dropped = _supported(found, last, judge, course)
    before, after = judge.left_out(found.nominal), judge.left_out(found.final)
    verdict = _verdict(found, reasons, unexplained=_is_unexplained(left, forms))
    brief = after.is_shaken and verdict not in (ADEQUATE, RESTLESS)
    if verdict == UNLISTED:
        models = [(before, ""), (after, ""), *([form] if form is not None else [])]
        after, formula = min(models, key=lambda one: np.nan_to_num(one[0].brief_error if brief else one[0].error, nan=np.inf))
    else:
        formula = ""
        after = after if verdict in (MISSING, UNDECIDED) else before
    course.clock.lap("evidence")
    diagnosis = _concluded(experiment, found, verdict, formula, before, after, brief, left, reasons, among, course)
    course.clock.lap("location")
    return dataclasses.replace(diagnosis, warnings=(*diagnosis.warnings, *dropped, *partly))


class _Weighed(NamedTuple):
    """A search with what is left beside its last model, and why its effects are not asserted."""

    search: Search
    left: Free
    forms: int
    form: tuple[LeftOut, str] | None
    reasons: dict[str, str]
    dropped: tuple[str, ...] = ()


def _supported(found: Search, last: Scores, judge: Judge, course: _Course) -> _Weighed:
    """The search, without its last effects where only those are not asserted; whole where its first one is not."""
    whole, dropped, lesser = None, (), found
    try:
        whole = tried = _weigh(found, last, judge, course.within_budget)
        while tried.search.steps[1:] and any(tried.reasons.values()):
            step, names = tried.search.steps[-1], [one.alternatives[0].name for one in tried.search.steps[:-1]]
            if [effect.name for effect in step.scores.fitted.problem.model.effects] != names:
                break
            name = step.alternatives[0].name
            reason = tried.reasons[name] or "the effects beside it are not asserted"
            dropped = (f"{name} was taken in and left out again: {reason}", *dropped)
            kept = tuple(dataclasses.replace(one, beside_later=()) for one in tried.search.steps[:-1])
            lesser = dataclasses.replace(lesser, final=step.scores.fitted, steps=kept, last=step)
            tried = _weigh(lesser, step.scores, judge, course.within_budget)
    except OutOfBudgetError:
        reasons = {step.alternatives[0].name: _TIME for step in found.steps}
        whole = whole or _Weighed(search=found, left=_free(last), forms=len(last.free), form=None, reasons=reasons)
        return whole._replace(search=dataclasses.replace(found, finished=False))
    return whole if any(tried.reasons.values()) else tried._replace(dropped=dropped)


def _weigh(found: Search, last: Scores, judge: Judge, progress: Progress) -> _Weighed:
    """Free forms beside the last model of a search, and why its effects are not asserted, else those that were refused."""
    forms = len(last.free)
    against, left, form = _with_prediction(_free(last), forms, last, found.final, judge, progress)
    limit = _AT_LIMIT if is_largest(found.final.problem, found.final.variances.force) else ""
    first = [step.alternatives[0] for step in found.steps]
    taken = {one.name: judge.why_not(found.nominal, one, found.final, against, forms) or limit for one in first}
    last_refused = found.last.refused if found.last is not None else ()
    refused = {one.name: one.refused for one in last_refused if one.candidate.form is None}
    return _Weighed(search=found, left=left, forms=forms, form=form, reasons=taken or refused)


def _free(scores: Scores) -> Free:
    """The best free forms beside a model, all variances estimated anew."""
    forms = [one for place, one in enumerate(scores.free) if place < _FORMS or one.candidate.members]
    weighed = all_weighed_anew(scores, forms)
    found = [(one, anew, scores.deviance - anew.deviance) for one, anew in zip(forms, weighed, strict=True) if anew is not None]
    return tuple(sorted(found, key=lambda one: -one[2]))


def _verdict(found: Search, reasons: dict[str, str], *, unexplained: bool) -> str:
    """The verdict; `decide` alone says whether an effect is asserted."""
    if not found.finished or not found.final.converged or NOT_CONVERGED in reasons.values():
        return UNDECIDED
    if reasons and not any(reasons.values()):
        return MISSING
    if reasons or unexplained or is_largest(found.final.problem, found.final.variances.force):
        return UNLISTED
    return RESTLESS if unrest(found.final, alpha=LEVEL) or _beyond_noise(found.final) else ADEQUATE


def _beyond_noise(fitted: Fitted, *, declared: bool = True) -> dict[str, float]:
    """Channels whose readings are off by more than the noise that is declared for them, with the factor; the farthest first.

    Or, of the others, by more than the noise seen between neighbouring samples: an error that lasts longer may well be the sensor's.
    """
    guessed = {name for record in fitted.problem.experiment.records for name in record.noise_estimated}
    errors = zip(fitted.problem.chains.channels, fitted.variances.readings, strict=True)
    found = {name: one.std for name, one in errors if (name in guessed) != declared}
    return {name: times for name, times in sorted(found.items(), key=lambda pair: -pair[1]) if times > BEYOND_NOISE}


def _is_unexplained(left: Free, forms: int) -> bool:
    """Whether the best of so many free forms gains more than noise alone gives one."""
    if not left:
        return False
    form, gain = left[0][0].candidate, left[0][2]
    return chance(gain, len(form.signals), forms * form.tried) < LEVEL


def _with_prediction(
    left: Free, forms: int, last: Scores, final: Fitted, judge: Judge, progress: Progress
) -> tuple[Free, Free, tuple[LeftOut, str] | None]:
    """The free forms by what they hold against an effect, and by what they explain; the best fitted model with one, with its formula.

    One that gains more than chance is fitted to the end, from the model beside which it was found, and has to predict records held back
    as an effect does: where it would not be asserted, it counts for nothing, and the next is fitted. One whose fit does not converge has
    not been refuted, whatever it predicts: against an effect its gain at first order stands. Records left out in turn are not asked: one
    alone may not reach all knots.
    """
    against, explaining, best = [], [], None
    for scored, weighed, gain in left:
        begun = at_first_order(last, weighed)
        form, refuting = learned(begun, scored.candidate, weighed.strengths), gain
        if best is None and form is not None and _is_unexplained(((scored, weighed, gain),), forms):
            progress(f"fitting {scored.candidate.name}")
            try:
                fitted = continued(*form, begun.fitted, progress)
                gain = final.deviance - fitted.deviance if fitted.converged else gain
                evidence = judge.evidence(
                    final,
                    fitted,
                    gain + judge.held_back_gain(final, fitted),
                    len(scored.candidate.signals),
                    forms * scored.candidate.tried,
                    in_turn=False,
                )
                gain = 0.0 if decide(evidence) else evidence.gain
                if fitted.converged:
                    refuting = gain
                if gain > 0.0:
                    best = judge.left_out(fitted), fitted.problem.model_at(fitted.at).effects[-1].equation
            except (np.linalg.LinAlgError, NoConvergenceError):  # a form may leave no model that can be integrated
                pass
        against.append((scored, weighed, refuting))
        explaining.append((scored, weighed, gain))
    by_gain = [tuple(sorted(found, key=lambda one: -one[2])) for found in (against, explaining)]
    return by_gain[0], by_gain[1], best


def _concluded(
    experiment: Experiment,
    found: Search,
    verdict: str,
    formula: str,
    before: LeftOut,
    after: LeftOut,
    brief: bool,
    left: Free,
    reasons: dict[str, str],
    among: Collection[str],
    course: _Course,
) -> Diagnosis:
    """The verdict with its evidence: errors, alternatives, location of the misfit."""
    course.progress("describing where the misfit acts")
    errors = errors_of(before, after, brief=brief)
    shown_before = _side(before, errors[0], brief=brief)
    shown_after = shown_before if after is before else _side(after, errors[1], brief=brief)
    named = tuple(_asserted(step, shown_after, after.fitted) for step in found.steps) if verdict == MISSING else ()
    named = tuple(sorted(named, key=lambda one: -one.probability))
    asserted = {one.effect.name for one in named}
    twins = {step.alternatives[0].name: [one for one in _twins(step) if one.name not in asserted] for step in found.steps}
    ambiguous = {name: [one.name for one in those] for name, those in twins.items() if those} if verdict == MISSING else {}
    location = None
    if verdict in (MISSING, UNLISTED, UNDECIDED):
        if (first := found.first) is not None:
            free = _free(first) if found.steps else left
            effect = next((one.effect for one in named if one.effect.record is not None), named[0].effect if named else None)
            location = locate(first, shown_before.records, free, effect)
    if ambiguous:
        course.progress("simulating further records")
    restless = unrest(after.fitted, alpha=LEVEL)
    finished = found.finished
    models = {"nominal": shown_before.model} | ({} if after is before else {"augmented": shown_after.model})
    return Diagnosis(
        experiment=experiment,
        verdict=verdict,
        sentences=sentences(
            verdict,
            named,
            ambiguous,
            location,
            shown_before,
            shown_after,
            formula,
            restless,
            _beyond_noise(after.fitted),
            _beyond_noise(after.fitted, declared=False),
            reasons={name: reason for name, reason in reasons.items() if reason},
            finished=finished,
            limited=bool(limit_warning(among)),
        ),
        effects=named,
        free_form=formula,
        ambiguous_with=tuple(dict.fromkeys(name for those in ambiguous.values() for name in those)),
        location=location,
        considered=_considered(found),
        nominal=shown_before,
        augmented=shown_after,
        unrest=restless,
        reading_error=sensor_errors(after.fitted),
        next_experiment=_next_experiment(experiment, found, twins, shown_after) if ambiguous else "",
        warnings=(*_warnings(found), *limit_warning(among)),
        seconds=course.clock.seconds,
        ring_downs=ring_downs(experiment, (*shown_before.records, *shown_before.held_back), models),
    )


def _side(one: LeftOut, error: float, *, brief: bool) -> Side:
    """A model with parameters, predictions and its error on what was left out."""
    fitted = one.fitted
    records = record_fits(fitted)
    chi2 = sum(value * record.samples for record in records for value in record.chi2_reduced.values())
    samples = sum(record.samples for record in records for _ in record.chi2_reduced)
    return Side(
        model=fitted.problem.model_at(fitted.at),
        parameters=_numbers(fitted),
        chi2_reduced=chi2 / max(samples, 1),
        held_out_nrmse=error,
        brief=brief,
        records=records,
        disagreements=between_records(fitted),
        held_back=one.held_back,
    )


def _numbers(fitted: Fitted) -> tuple[Quantity, ...]:
    """Every shared parameter with its standard error; None where it is not identifiable or at a bound."""
    table = estimates(fitted, uncertainty(fitted), {}, first={}, profiled=False)
    return tuple(
        Quantity(
            name=one.spec.name,
            symbol=one.spec.symbol,
            unit=one.spec.unit,
            value=one.value,
            stderr=float(np.hypot(one.stderr, one.spec.resolution)) if one.status == OK and one.stderr is not None else None,
        )
        for one in table
    )


def _asserted(step: Step, side: Side, fitted: Fitted) -> Asserted:
    """One effect of the final model with its probability and parameters."""
    name = step.alternatives[0].name
    effect = next(one for one in side.model.effects if one.name == name)
    prefix = f"{name}."
    numbers = [dataclasses.replace(n, name=n.name.removeprefix(prefix)) for n in side.parameters if n.name.startswith(prefix)]
    own = [place for place, each in enumerate(fitted.problem.unknowns.own) if each.startswith(prefix)]
    if own:
        one, *others = [p for p in effect.parameters if p.per_record]
        name, symbol = ("amplitude", "A") if others else (f"rms_{one.name}", f"rms {one.symbol}")
        acts = fitted.problem.border.own[:, own].any(axis=1)
        size = float(np.sqrt(np.mean(np.sum(fitted.at.own[acts][:, own] ** 2, axis=1))))
        numbers.append(Quantity(name=name, symbol=symbol, unit=unit_in(one.unit, effect.channel), value=size, stderr=None))
    gaps = {record.gap for record in fitted.problem.experiment.records}
    return Asserted(
        effect=effect,
        probability=round(_probability(step), _DECIMALS),
        parameters=tuple(numbers),
        gap=gaps.pop() if len(gaps) == 1 else None,
    )


def _rivals(alternatives: Sequence[Alternative]) -> list[Alternative]:
    """The effect taken in, and others that were fitted and not refused beside it, those that contain it left out, and free forms."""
    best, *others = alternatives
    fitted = [one for one in others if one.drop is not None and not one.refused and one.candidate.form is None]
    return [best, *(one for one in fitted if best.name not in one.candidate.members[0].special_cases)]


def _probability(step: Step) -> float:
    """Weight exp(-BIC / 2) of the best among the alternatives of its step, times 1 - chance."""
    best, samples = step.alternatives[0], step.scores.fitted.local.samples
    lowest = best.criterion(samples)
    weights = {id(one): float(np.exp(-0.5 * np.clip(one.criterion(samples) - lowest, 0.0, 1400.0))) for one in _rivals(step.alternatives)}
    mine = sum(weights[id(one)] for one in _rivals(step.alternatives) if one.name == best.name)
    return (1.0 - chance(best.best, best.degrees, best.tried)) * mine / sum(weights.values())


def _twins(step: Step) -> list[Alternative]:
    """Effects that the records cannot separate from the best: chance alone could have put these first, beside later effects if any."""
    best, *others = _rivals(step.beside_later or step.alternatives)
    return [one for one in others if one.name != best.name and is_twin(one, best, step.scores.fitted.local.samples)]


def _next_experiment(experiment: Experiment, found: Search, twins: dict[str, list[Alternative]], side: Side) -> str:
    """The record that would best separate the first effect with twins from those whose fitted model was kept."""
    step = next(step for step in found.steps if twins[step.alternatives[0].name])
    best = step.alternatives[0]
    named = found.final if step.beside_later else best.fitted
    causes = {one.name: one.cause for one in twins[best.name] if one.cause is not None}
    return next_experiment(experiment, Cause.of(named), causes, best.name, side.records) if named is not None else ""


def _considered(found: Search) -> tuple[Considered, ...]:
    """All candidates by step and decreasing score, with what came of those that were weighed anew or fitted."""
    rows = []
    for step in (*found.steps, *([found.last] if found.last is not None else [])):
        samples = step.scores.fitted.local.samples
        weighed = [one for one in (*step.alternatives, *step.refused) if one.fitted_gain >= 0.0]  # less is a fit that failed
        tried = {one.candidate.key: one for one in weighed}
        lowest = min((one.criterion(samples) for one in tried.values()), default=0.0)
        beside = tuple(effect.name for effect in step.scores.fitted.problem.model.effects)
        fitted_forms = [one for one in step.scores.free if one.candidate.members]
        for key, scored in best_of_each([*step.scores.listed, *fitted_forms]).items():
            one = tried.get(key)
            degrees = int(scored.known.sum()) or 1
            rows.append(
                Considered(
                    name=scored.candidate.name,
                    detail=detail(scored.candidate),
                    gain=scored.gain,
                    chance=chance(scored.gain, degrees, len(step.scores.listed)),
                    drop=None if one is None else one.fitted_gain,
                    bic=None if one is None else one.criterion(samples) - lowest,
                    held_out=one.held_back if one is not None and one.held_back else None,
                    beside=beside,
                )
            )
    return tuple(rows)


def _warnings(found: Search) -> tuple[str, ...]:
    """Warnings beside the verdict: unfinished search, no convergence."""
    said = []
    if not found.finished:
        broken_off = [step for step in (*found.steps, found.last) if step is not None and not step.finished]
        names = dict.fromkeys(one.name for step in broken_off for one in step.alternatives if one.drop is None and is_significant(one))
        said.append(f"{NOT_FINISHED}: {_TIME}{f' ({joined(list(names))} not fitted)' if names else ''}; allow more minutes")
    if len(found.steps) == MOST_EFFECTS:
        said.append("the search stopped after as many effects as it adds to one model: more may be missing")
    if not found.final.converged:
        said.append("the last fit stopped before it had converged: its numbers may still move by more than their errors")
    if lost := int(np.sum(~found.final.linear.done)):
        said.append(f"{lost} of {len(found.final.linear.done)} segments could not be integrated and do not count")
    return tuple(said)
