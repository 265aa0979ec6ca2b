"""Scores of all candidates beside one fitted model, and the best of them with all variances estimated anew."""

import dataclasses
import itertools
import os
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from difflib import get_close_matches
from functools import cached_property

import numpy as np

from identification.diagnosis.decide import BEYOND_NOISE, LEVEL
from identification.diagnosis.diagnosis import LIMITED
from identification.diagnosis.free_forms import Form, free_forms
from identification.diagnosis.scales import probe_scales
from identification.diagnosis.signals import signals
from identification.experiment.samples import runs_of
from identification.guesses.parameters import Loops, likelier_start
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated, Scorer, reestimated, scorer, some_force
from identification.trajectory.course import BySample, Course, Signal, by_sample, courses, responses
from identification.trajectory.fit import Fitted, first_variances
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.segments import Chains
from identification.trajectory.start import Problem
from identification.trajectory.variances import Variances, vanishes
from identification.wording.numbers import joined
from vibrojax.effects import EFFECTS, AbstractEffect, ProbeScales
from vibrojax.effects.formula import Formula
from vibrojax.errors import InputError

LARGE_PART = 0.05
"""Random force over the force of the suspension, or reading error over the signal, above which scores do not order candidates."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Candidate:
    """An addition to the model: an effect at the strength at which it is probed, or was aligned, or a free form.

    Attributes:
        name: of the effect or of the free form.
        members: effects whose strengths are estimated together; none for a free form that is a function of the motion.
        signals: of its columns.
        form: free form; None for an effect.
    """

    name: str
    members: tuple[AbstractEffect, ...]
    signals: tuple[Signal, ...]
    form: Form | None = None

    @property
    def tried(self) -> int:
        """Places among which a free form was the best; 1 for an effect, whose probe counts them."""
        return 1 if self.form is None else self.form.tried

    @property
    def channel(self) -> str:
        """That it acts on alone; empty for all."""
        return (self.members[0].channel or "") if self.members else ""

    @property
    def key(self) -> tuple[str, str]:
        """Name and channel: what a reader takes for one cause."""
        return self.name, self.channel


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scored:
    """A candidate with its score; see `Score`."""

    candidate: Candidate
    gain: float
    strengths: np.ndarray
    known: np.ndarray
    directions: np.ndarray | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scores:
    """All candidates beside one fitted model.

    Attributes:
        fitted: the model.
        scales: from which the candidates come.
        courses: the estimated motion.
        by: derivatives from sample to sample.
        listed, free: scored, by decreasing gain, the best of each kind first by `best`.
    """

    fitted: Fitted
    scales: ProbeScales
    courses: tuple[Course, ...]
    by: BySample
    listed: tuple[Scored, ...]
    free: tuple[Scored, ...]

    @cached_property
    def alone(self) -> Reestimated:
        """The model without any candidate, all variances estimated anew."""
        return weighed_anew(self, None)

    @property
    def deviance(self) -> float:
        """-2 log likelihood of that."""
        return self.alone.deviance

    @cached_property
    def in_loops(self) -> frozenset[str]:
        """Names of listed effects that change the law of the stop, as the measured loops of force over indentation show.

        No motion is integrated for that, so that it holds where the fitted model is far off. The loop of one impact shows as many numbers
        as the law has, and counts for as many observations.
        """
        problem, found = self.fitted.problem, set()
        impacts = sum(len(runs_of(motion.touching)[0]) for motion in problem.motions if motion is not None)
        for effect in {one.candidate.name: one.candidate.members[0] for one in self.listed if one.candidate.members}.values():
            if not (effect.does("stop") and problem.model.has_stop):
                continue
            plain, changed = read_off_loops(problem, self.scales), read_off_loops(problem, self.scales, effect)
            if plain is None or changed is None or plain.load_cell != changed.load_cell:
                continue
            gain = impacts * len(problem.model.law.parameters) * np.log(plain.misfit / max(changed.misfit, 1e-300))
            if chance(gain, sum(not p.searched for p in effect.parameters), 1) < LEVEL:
                found.add(effect.name)
        return frozenset(found)


def read_off_loops(problem: Problem, scales: ProbeScales, effect: AbstractEffect | None = None) -> Loops | None:
    """Law of the stop, as an effect changes it if one is given, and errors of the gaps, as the loops of force over indentation show them.

    Exponents of the model's own law are then held: loops that drift mislead these. A place of the effect's own is left to the errors.
    """
    model, given = problem.model_at(problem.start), problem.experiment.parameters
    before = dataclasses.replace(model, effects=tuple(one for one in model.effects if effect is None or one.name != effect.name))
    free = {name for place, (name, _) in enumerate(problem.unknowns.shared) if problem.border.shared[place]}
    free -= {name for name, option in given.items() if option.start is not None}
    names = tuple(p.name for p in model.law.parameters if p.name in free and (effect is None or p.logarithmic))
    read = before, list(problem.experiment.records), list(problem.motions)
    if effect is None:
        return likelier_start(*read, names)
    own = tuple(f"{effect.name}.{p.name}" for p in effect.parameters if not (p.searched or p.from_gap))

    def at_strengths(deepest: float, force: float) -> list[AbstractEffect]:
        return list(effect.probe.effects(dataclasses.replace(scales, deepest=deepest, force=force)))

    return likelier_start(*read, (*names, *own), at_strengths)


def score_all(fitted: Fitted, among: Collection[str] = EFFECTS, terms: Sequence[Formula] = ()) -> Scores:
    """Score every listed effect and every term of the user that the model does not hold, and the free forms.

    Scores hold the variances, which what is missing may have made too large: every candidate is scored under several (`_variances`), and
    its largest gain counts. They only choose what is estimated anew.
    """
    along, sampled = courses(fitted)
    by, scales = by_sample(fitted, sampled), probe_scales(fitted, along)
    held = {effect.name for effect in fitted.problem.model.effects}
    kinds = [kind for name, kind in known_effects(terms).items() if name in among and name not in held]
    candidates = itertools.chain(*_side_by_side(lambda kind: _of_kind(kind, scales, along, fitted.problem.chains), kinds))
    listed = _scored(fitted, by, list(candidates))
    forms = [Candidate(name=one.name, members=one.members, signals=one.signals, form=one) for one in free_forms(fitted, along, scales)]
    free = _scored(fitted, by, forms)
    return Scores(fitted=fitted, scales=scales, courses=along, by=by, listed=listed, free=free)


def best_of_each(found: Sequence[Scored]) -> dict[tuple[str, str], Scored]:
    """The candidate of largest gain of every kind and channel, best first."""
    best: dict[tuple[str, str], Scored] = {}
    for one in sorted(found, key=lambda one: -one.gain):
        best.setdefault(one.candidate.key, one)
    return best


def hides_the_order(fitted: Fitted, variances: Variances) -> bool:
    """Whether so much is taken for random that the scores of candidates do not order them; noise as declared hides nothing."""
    problem = fitted.problem
    signals = np.std(problem.chains.measured * problem.chains.weight, axis=(0, 1))
    errors = [one.std / max(s, 1.0) for one, s in zip(variances.readings, signals, strict=True) if one.std > BEYOND_NOISE]
    return bool(max([variances.force.std / problem.scales.force, *errors]) > LARGE_PART)


def detail(candidate: Candidate) -> str:
    """Channel, record, and what a candidate's grid has set, as text."""
    if not candidate.members:
        return ""
    effect = candidate.members[0]
    own = [f"{p.symbol} {float(getattr(effect, p.field)):.3g} {p.unit}" for p in effect.parameters if p.name.endswith("_hz") or p.searched]
    return ", ".join([text for text in (effect.channel, effect.record) if text] + own)


def known_effects(terms: Sequence[Formula] = ()) -> dict[str, type[AbstractEffect] | Formula]:
    """Every effect that may be looked for by name: the listed ones, and terms of the user."""
    return {**EFFECTS, **{term.name: term for term in terms}}


def among_effects(only: Sequence[str] = (), without: Sequence[str] = (), terms: Sequence[Formula] = ()) -> tuple[str, ...]:
    """Names of the effects that may be added: `only` these, or all listed ones and the terms, `without` those.

    Raises:
        InputError: an unknown name, a single text in place of several names, or no effect is left.

    Example:
        >>> among_effects(only=["hysteresis", "quadratic_drag"], without=["hysteresis"])
        ('quadratic_drag',)
    """
    known = known_effects(terms)
    for given in (only, without):
        if isinstance(given, str):
            raise InputError(f"{given!r} is one text: expected a list of names of effects, such as [{given!r}]")
        for name in given:
            if name not in known:
                near = get_close_matches(name, known, n=1)
                expected = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
                raise InputError(f"no effect is called {name!r}: {expected}")
    found = tuple(name for name in known if (name in only or not only) and name not in without)
    if not found:
        raise InputError(f"without {joined(list(without))} no effect is left to look for: exclude fewer of them")
    return found


def limit_warning(among: Collection[str]) -> tuple[str, ...]:
    """Warning for the reader of a diagnosis that did not look for all listed effects; empty otherwise."""
    absent = [name for name in EFFECTS if name not in among]
    if not absent:
        return ()
    names = [name for name in EFFECTS if name in among]
    if not names:
        return (f"{LIMITED}: none of the listed effects could be named",)
    text = f"only {joined(names)} could be named" if len(names) < len(absent) else f"{joined(absent)} could not be named"
    return (f"{LIMITED}: of the listed effects, {text}",)


def weighed_anew(scores: Scores, one: Scored | None) -> Reestimated:
    """The model with a candidate at first order, or without any, and all variances estimated anew."""
    columns = responses(scores.by, scores.fitted.problem.chains, [] if one is None else list(one.candidate.signals))
    if one is None or one.directions is None:
        return reestimated(scores.fitted, *columns)
    identified = one.directions
    found = reestimated(scores.fitted, columns[0] @ identified, columns[1] @ identified)
    return dataclasses.replace(found, strengths=identified @ found.strengths, covariance=identified @ found.covariance @ identified.T)


def all_weighed_anew(scores: Scores, candidates: Sequence[Scored]) -> list[Reestimated | None]:
    """Every candidate `weighed_anew`, side by side; None for one that takes the motion too far at first order to be weighed."""

    def one(candidate: Scored) -> Reestimated | None:
        try:
            return weighed_anew(scores, candidate)
        except np.linalg.LinAlgError:
            return None

    return _side_by_side(one, candidates)


def _side_by_side(function: Callable, items: Iterable) -> list:
    """A function of every item, in their order, in threads: few, since some hold copies of the linearisation."""
    with ThreadPoolExecutor(min(len(os.sched_getaffinity(0)), 4)) as threads:
        return list(threads.map(function, items))


def _of_kind(kind: type[AbstractEffect] | Formula, scales: ProbeScales, along: tuple[Course, ...], chains: Chains) -> list[Candidate]:
    """Candidates of one effect with their signals."""
    by_place: dict[tuple, list[tuple[AbstractEffect, ...]]] = {}
    for members in kind.probe.candidates(scales):
        by_place.setdefault((members[0].channel, members[0].record), []).append(members)
    found = []
    for group in by_place.values():
        flat = iter(signals(along, chains, [member for members in group for member in members]))
        for members in group:
            columns = [next(flat) for _ in members]
            if members[0].record is not None:
                columns = [_in_record(one, chains, chains.files.index(members[0].record)) for one in columns]
            if any(p.per_record for p in members[0].parameters):
                columns = [_in_record(one, chains, index) for one in columns for index in range(len(chains.knots))]
            found.append(Candidate(name=members[0].name, members=members, signals=tuple(columns)))
    return found


def _in_record(signal: Signal, chains: Chains, index: int) -> Signal:
    """A signal in one record alone."""
    mine = (chains.record == index)[:, None]
    return Signal(
        force=None if signal.force is None else signal.force * mine,
        stop=None if signal.stop is None else signal.stop * mine,
        readings={name: values * mine for name, values in signal.readings.items()},
        record=index,
    )


def _scored(fitted: Fitted, by: BySample, candidates: Sequence[Candidate]) -> tuple[Scored, ...]:
    """Largest score of every candidate over several variances, by decreasing gain."""
    scorers = _scorers(fitted)
    batches: list[list[Candidate]] = [[]]
    for candidate in candidates:
        if len(_packed([*batches[-1], candidate])[0]) > 24:  # columns at once in each thread: memory of a few linearisations
            batches.append([])
        batches[-1].append(candidate)
    found = itertools.chain(*_side_by_side(lambda batch: _batch(fitted, by, scorers, batch), filter(None, batches)))
    return tuple(sorted(found, key=lambda one: -one.gain))


def _scorers(fitted: Fitted) -> list[Scorer]:
    """Scorers under the variances of the fit, and under every other one of `_variances` whose equations can be solved.

    Rounding may make these indefinite, where the state of an effect is large beside its share of the motion.

    Raises:
        LinAlgError: the equations under the fit's own variances cannot be solved.
    """
    own, *others = _variances(fitted)
    found = [scorer(fitted.problem, fitted.at, fitted.linear, own)]
    for one in others:
        with suppress(np.linalg.LinAlgError):
            found.append(scorer(fitted.problem, fitted.at, fitted.linear, one))
    return found


def _packed(candidates: Sequence[Candidate]) -> tuple[list[list[Signal]], list[list[int]]]:
    """Signals by column, one that acts in a single record beside those of other records; and the columns of every candidate's signals."""
    columns: list[list[Signal]] = []
    mixed: list[int] = []  # columns of signals that act in single records
    used: dict[int, int] = {}  # by record, how many of these hold a signal of it
    places: list[list[int]] = []
    for candidate in candidates:
        places.append([])
        for signal in candidate.signals:
            column = len(columns)
            if signal.record is not None:
                number = used.get(signal.record, 0)
                used[signal.record] = number + 1
                if number == len(mixed):
                    mixed.append(column)
                column = mixed[number]
            if column == len(columns):
                columns.append([])
            columns[column].append(signal)
            places[-1].append(column)
    return columns, places


def _joined(signals: list[Signal]) -> Signal:
    """The sum of signals that act in different records."""
    forces, stops = ([x for x in parts if x is not None] for parts in ([s.force for s in signals], [s.stop for s in signals]))
    readings: dict[str, np.ndarray] = {}
    for one in signals:
        for name, values in one.readings.items():
            readings[name] = readings[name] + values if name in readings else values
    return Signal(force=np.sum(forces, axis=0) if forces else None, stop=np.sum(stops, axis=0) if stops else None, readings=readings)


def _batch(fitted: Fitted, by: BySample, scorers: list[Scorer], batch: list[Candidate]) -> list[Scored]:
    chains = fitted.problem.chains
    records = np.arange(len(chains.knots))
    packed, places = _packed(batch)
    columns = responses(by, chains, [_joined(signals) for signals in packed])
    alive = fitted.linear.done[:, None, None]
    columns = columns[0] * alive[..., None], columns[1] * alive
    finite = np.isfinite(columns[0]).all(axis=(1, 2)) & np.isfinite(columns[1]).all(axis=1)
    finite = np.logical_and.reduceat(finite, np.flatnonzero(chains.first), axis=0)
    columns = tuple(np.where(finite[chains.record][:, *[None] * (one.ndim - 2)], one, 0.0) for one in columns)
    best: list[Scored | None] = [None] * len(batch)
    for each in scorers:
        reduced = each.reduced(each.score(*columns))
        for index, (one, column) in enumerate(zip(batch, places, strict=True)):
            active = np.stack([np.isin(records, records if s.record is None else s.record) for s in one.signals], axis=1)
            score = reduced.scored(column, active) if finite[:, column][active].all() else None
            if score is None:
                continue
            wrong_way = bool(one.members) and not one.members[0].probe.either_sign and score.strengths[0] < 0
            gain = 0.0 if wrong_way else score.gain
            known = best[index]
            if known is None or gain > known.gain:
                best[index] = Scored(candidate=one, **vars(dataclasses.replace(score, gain=gain)))
    return [one for one in best if one is not None]


def _variances(fitted: Fitted) -> list[Variances]:
    """Those of the fit; a tenth of the random force; white reading errors of the same size. Each once.

    Without a random force, rounding would leave nothing of what another force says, and reading errors may have taken its place: then a
    little force beside those errors, and the variances from which a fit begins.
    """
    own, force = fitted.variances, some_force(fitted)
    if vanishes(fitted.problem, own.force):
        return [own, dataclasses.replace(own, force=force), first_variances(fitted.problem)]
    found = [own, dataclasses.replace(own, force=RandomForce(std=0.1 * force.std, memory=force.memory))]
    if any(one.order for one in own.readings):
        found.append(dataclasses.replace(own, readings=tuple(ReadingError(innovation=one.std) for one in own.readings)))
    return found
