"""A candidate taken into the model: from signals along the motion to physics inside the chain, iterated to the end."""

import dataclasses
from collections.abc import Callable
from contextlib import suppress

import jax
import jax.numpy as jnp
import numpy as np

from identification.diagnosis.lags import LONGEST, misalignment
from identification.diagnosis.scores import Candidate, Scored, Scores, hides_the_order, read_off_loops
from identification.diagnosis.signals import own_states, signals
from identification.experiment import Record
from identification.guesses.motion import driving_channels
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted, Progress, fit
from identification.trajectory.motion import Estimate
from identification.trajectory.remodel import remodelled
from identification.trajectory.segments import OF_RECORD, Lateness
from identification.trajectory.start import Problem, begun_from
from identification.trajectory.variances import is_largest, vanishes
from vibrojax.effects import AbstractEffect, ProbeScales
from vibrojax.effects.free_form import FreeForm
from vibrojax.errors import NoConvergenceError

_COARSE = 100
"""Steps of the first search for a channel's lateness, on either side."""


def augmented(scores: Scores, candidate: Candidate, weighed: Reestimated, *, progress: Progress = lambda line: None) -> Fitted:
    """The model with a candidate in it, fitted to the end, and anew where that is less likely than the model without, which it contains.

    Args:
        scores: in which the candidate was found.
        candidate: an effect, or a free form with members.
        weighed: the model with it at first order, from which its fit starts; of a stop that says nothing.
        progress: called with a line in each round.
    """
    of_stop = candidate.members[0].probe.is_stop or candidate.members[0].does("stop")
    begun = scores if of_stop else at_first_order(scores, weighed)
    return refitted(*extended(begun, candidate, weighed.strengths), begun.fitted, progress, simpler=scores.fitted)


def at_first_order(scores: Scores, weighed: Reestimated) -> Scores:
    """The scores, their model at the estimate and with the variances that a candidate gives it at first order."""
    return dataclasses.replace(scores, fitted=dataclasses.replace(scores.fitted, at=weighed.at, variances=weighed.variances))


def refitted(problem: Problem, near: Estimate | None, beside: Fitted, progress: Progress, *, simpler: Fitted | None = None) -> Fitted:
    """A problem fitted from an estimate and variances near its own; unless that is as likely as it must be, anew from both ends.

    Where physics is missing, the estimate may be far off, and reading errors may have taken the place of physics: then the fit from the
    measured trajectory with a large force is the better one. With a large force, on the other hand, the records hardly determine an effect,
    and its parameters may leave their first estimates.

    Args:
        problem: that begins at the measured trajectory.
        near: estimate of it from another model; None where that says nothing.
        beside: that model, from whose variances the fit starts.
        simpler: model that it contains. The first fit is good enough where it is as likely, unless it takes so much for random that scores
            would not order candidates; without a force it is, unless reading errors had taken its place. Of two fits, one better
            `only_by_force` comes second.
        progress: called with a line in each round.
    """
    found = None
    if near is not None:
        with suppress(NoConvergenceError):
            found = continued(problem, near, beside, progress)
            found = found if found.converged else None
    if found is not None:
        force = found.variances.force
        explained = vanishes(problem, force) and not beside.of_readings
        if explained or (simpler is not None and found.deviance <= simpler.deviance and not hides_the_order(found, found.variances)):
            return found
    try:
        anew = fit(problem, progress=progress)
    except NoConvergenceError:
        if found is None:
            raise
        return found
    if found is None or not anew.converged:
        return found or anew
    return min(anew, found, key=lambda one: (simpler is not None and only_by_force(one, simpler), one.deviance))


def only_by_force(fitted: Fitted, other: Fitted) -> bool:
    """Whether a fit has its random force at the upper limit, where any motion is explained, and another model has not."""
    return is_largest(fitted.problem, fitted.variances.force) and not is_largest(other.problem, other.variances.force)


def continued(problem: Problem, near: Estimate, beside: Fitted, progress: Progress) -> Fitted:
    """A problem fitted from the estimate and the variances of another model; prescribed motion and a rigid stop begin as `fit` says.

    Raises:
        NoConvergenceError: the equations became singular on the way.
    """
    found = fit(problem, at=near, begin=beside.variances, both=False, progress=progress)
    return dataclasses.replace(found, of_readings=beside.of_readings)


def extended(scores: Scores, candidate: Candidate, strengths: np.ndarray) -> tuple[Problem, Estimate | None]:
    """The problem with a candidate in the model, at the strengths that it starts from, and its estimate by the model without.

    There is no estimate where the motion of the model without misleads: it went through the stop that the effect brings; or, with no other
    effect in the model, it followed impacts that a filter of all channels had smeared, or channels of which the records show one to be
    late. The problem then begins at the loops of force over indentation, or at the records with the effect undone. A lateness that was
    `aligned` begins as it is, whatever its strength. So does a filter of all channels: its strength at first order, estimated along smeared
    impacts, is several times too small.
    """
    whole, is_aligned = scores.fitted.problem.model_at(scores.fitted.at), _is_aligned(scores, candidate)
    if _smears_impacts(scores, candidate) or (is_aligned and is_shown_late(scores, candidate)):
        return _begun_undone(scores.fitted, candidate.members[0]), None
    effect, own = (candidate.members[0], {}) if is_aligned else strengthened(candidate.members, strengths)
    problem, near = _with(scores.fitted, (*whole.effects, effect), own=own, states=_states(scores, effect))
    if not effect.does("stop"):
        return problem, near
    begun = _from_loops(problem, effect, scores.scales)
    return begun, near if whole.has_stop or begun is problem else None


def _smears_impacts(scores: Scores, candidate: Candidate) -> bool:
    """Whether a candidate is a filter of all channels, beside impacts and in a model without other effects."""
    of_all = candidate.members[0].does("undone") and not _makes_late(candidate)
    return of_all and scores.scales.force > 0 and not scores.fitted.problem.model.effects


def is_shown_late(scores: Scores, candidate: Candidate) -> bool:
    """Whether a candidate makes a channel late that is late by the records alone, in a model without other effects."""
    late = _makes_late(candidate) and candidate.channel in scores.scales.lags
    return late and not scores.fitted.problem.model.effects


def _makes_late(candidate: Candidate) -> bool:
    """Whether a candidate makes one channel late."""
    return bool(candidate.channel) and candidate.members[0].does("lateness")


def _is_aligned(scores: Scores, candidate: Candidate) -> bool:
    """Whether a candidate makes its channel late by more than a sample, at the end of the longest record: none is probed with as much."""
    return _makes_late(candidate) and abs(float(candidate.members[0].lateness(jnp.asarray(scores.scales.latest)))) > scores.scales.sampling


def _begun_undone(fitted: Fitted, effect: AbstractEffect) -> Problem:
    """The problem with an effect that begins at the motion that the records show without it, with the memory of its filters."""
    problem, _ = _with(fitted, (effect,))
    (effect,) = problem.model_at(problem.start).effects  # within its bounds
    records, chains = fitted.problem.experiment.records, fitted.problem.chains
    before, memory = tuple(_undone(record, effect) for record in records), np.zeros((chains.knot_count, len(effect.own_states)))
    for knots, record, ideal in zip(chains.knots, records, before, strict=True):
        readings, shown = ({name: jnp.asarray(x) for name, x in one.channels.items()} for one in (ideal, record))
        kept = np.asarray(effect.memory(readings, shown, jnp.zeros((len(record.time), memory.shape[1]))))
        rows = np.minimum(np.arange(knots.stop - knots.start) * chains.samples, len(kept) - 1)
        memory[knots] = np.nan_to_num(kept[rows])  # settled where a sample is missing
    problem, _ = _with(fitted, (effect,), states=_by_name(effect, memory))
    begun, states = begun_from(problem, before), problem.start.states.copy()
    states[:, :2] = begun.start.states[:, :2]
    return dataclasses.replace(begun, start=dataclasses.replace(begun.start, states=states))


def _undone(record: Record, effect: AbstractEffect) -> Record:
    """The record as ideal sensors would have it, and the noise that this leaves; an input of the rig stays, as the segments have it."""
    read = {name: jnp.asarray(values) for name, values in record.channels.items() if name not in driving_channels(record)}
    time, impulse = jnp.asarray(record.time), jnp.zeros(len(record.time)).at[len(record.time) // 2].set(1.0)
    ideal = effect.undone(read, time)
    changed = [name for name in read if ideal[name] is not read[name]]
    louder = {name: float(jnp.linalg.norm(effect.undone({name: impulse}, time)[name])) for name in changed}
    return dataclasses.replace(
        record,
        channels=record.channels | {name: np.asarray(ideal[name]) for name in changed},
        noise={name: std * max(louder.get(name, 1.0), 1.0) for name, std in record.noise.items()},
    )


def aligned(scores: Scores, scored: Scored) -> Scored:
    """A candidate that makes a channel late, at the lateness by which the channel agrees best; others, and up to a sample, as they are.

    A derivative shows no way to a delay longer than an impact. Where there are impacts, or the records show without a model that the
    channel is late, up to `LONGEST` on either side at the end of the longest record is tried: in some hundred steps, then in steps of half
    a sampling interval about the best. The channel is compared with the others if they show that it is late, else with the estimated
    motion.
    """
    candidate, problem = scored.candidate, scores.fitted.problem
    if not _makes_late(candidate) or not (scores.scales.force > 0 or candidate.channel in scores.scales.lags):
        return scored
    effect, records = candidate.members[0], _with_sensor(scores, candidate.channel)
    last = float(effect.lateness(jnp.asarray(scores.scales.latest)))
    if not records or not last:
        return scored
    shown = candidate.channel in scores.scales.lags
    misfit = misalignment(records, candidate.channel) if shown else _off_course(scores, records, candidate.channel)

    def at(factor: float) -> float:
        return misfit(lambda t: factor * np.asarray(effect.lateness(jnp.asarray(t))))

    step, count = 0.5 * scores.scales.sampling / last, int(LONGEST / (0.5 * scores.scales.sampling))
    coarse = max(1, count // _COARSE)
    rough = min(step * coarse * np.arange(-(count // coarse), count // coarse + 1), key=at)
    best = effect.scaled(min([0.0, *(rough + step * np.arange(1 - coarse, coarse))], key=at))
    changed = dataclasses.replace(candidate, members=(best,))
    if not _is_aligned(scores, changed):
        return scored
    found = signals(scores.courses, problem.chains, [best])
    return dataclasses.replace(scored, candidate=dataclasses.replace(changed, signals=tuple(found)))


def misalignment_of(scores: Scores, candidate: Candidate) -> float:
    """`misalignment` of a channel that the records show to be late, moved back as a candidate says; 0 for other candidates."""
    if not is_shown_late(scores, candidate):
        return 0.0
    effect, channel = candidate.members[0], candidate.channel
    return misalignment(_with_sensor(scores, channel), channel)(lambda t: np.asarray(effect.lateness(jnp.asarray(t))))


def _with_sensor(scores: Scores, channel: str) -> list[Record]:
    """Records in which a channel is a sensor's."""
    return [r for r in scores.fitted.problem.experiment.records if channel in r.channels and channel not in driving_channels(r)]


def _off_course(scores: Scores, records: list[Record], channel: str) -> Callable[[Lateness], float]:
    """Function of a lateness: mean squared error of a channel beside the estimated motion, over that of the noise.

    Infinite where a lateness leaves less than half of the readings to compare.
    """
    shown = {record.file: course for record, course in zip(scores.fitted.problem.experiment.records, scores.courses, strict=True)}
    values = [np.asarray(shown[record.file].readings[channel])[: len(record.time)] for record in records]

    def of(lateness: Lateness) -> float:
        errors = []
        for record, course in zip(records, values, strict=True):
            late = np.interp(record.time - lateness(record.time), record.time, course, left=np.nan, right=np.nan)
            errors.append((record.channels[channel] - late) / record.noise[channel])
        known = np.concatenate(errors)
        known = known[np.isfinite(known)]
        return float(np.mean(known**2)) if 2 * len(known) > sum(map(len, errors)) else np.inf

    return of


def _from_loops(problem: Problem, effect: AbstractEffect, scales: ProbeScales) -> Problem:
    """The problem that begins with the law of the stop, changed by an effect, that the loops of force over indentation show.

    Where the effect has a place of its own, it is counted from the record whose gap has no error.
    """
    found = read_off_loops(problem, scales, effect)
    if found is None:
        return problem
    placed = {f"{effect.name}.{p.name}" for p in effect.parameters if p.from_gap}  # the errors of the gaps say it
    errors, gap = found.gap_errors, OF_RECORD.index("gap_error")
    values, own = problem.values(problem.start) | found.values, problem.start.own.copy()
    for name in placed:
        stands = float(errors[~problem.border.own[:, gap]][0])
        values[name], errors = values[name] + stands, errors - stands
    own[:, gap] = errors
    shared = np.clip(problem.coordinates(values), problem.border.lower, problem.border.upper)
    return dataclasses.replace(problem, start=dataclasses.replace(problem.start, shared=shared, own=own))


def _with(fitted: Fitted, effects: tuple[AbstractEffect, ...], **begin: dict[str, np.ndarray]) -> tuple[Problem, Estimate]:
    """The problem with other effects, from where the fitted one began, and its estimate from that of the fitted one."""
    problem = fitted.problem
    model = dataclasses.replace(problem.model_at(fitted.at), effects=effects)
    return remodelled(problem, problem.start, model, **begin), remodelled(problem, fitted.at, model, **begin).start


def learned(scores: Scores, candidate: Candidate, strengths: np.ndarray) -> tuple[Problem, Estimate] | None:
    """The problem with a free form in the model, and its estimate by the model without; None for one over time."""
    form = candidate.form
    if candidate.members:
        effect, own = strengthened(candidate.members, strengths)
        return _with(scores.fitted, (*scores.fitted.problem.model_at(scores.fitted.at).effects, effect), own=own)
    if form is None or form.coordinate == "time":
        return None
    knots = np.unique(form.columns[:, 0])
    effect = FreeForm(
        coordinate=form.coordinate,
        knots=tuple(float(form.knots[k]) for k in knots),
        of_channel="" if form.quantity == "force" else form.quantity,
        by_direction=bool((form.columns[:, 1] != 0).any()),
        scales=(form.size,) * len(strengths),
        **{f"c{k}": float(form.size * strength) for k, strength in enumerate(strengths, start=1)},
    )
    return _with(scores.fitted, (*scores.fitted.problem.model_at(scores.fitted.at).effects, effect))


def without(fitted: Fitted, name: str) -> tuple[Problem, Estimate]:
    """The problem without one effect, and its estimate by the model with it."""
    return _with(fitted, tuple(effect for effect in fitted.problem.model_at(fitted.at).effects if effect.name != name))


def strengthened(members: tuple[AbstractEffect, ...], strengths: np.ndarray) -> tuple[AbstractEffect, dict[str, np.ndarray]]:
    """Effect of a candidate at estimated strengths, and its parameters per record by name, (records,) each.

    A stop begins where it was looked for: what is estimated of it at first order is no strength.
    """
    if members[0].probe.is_stop:
        return members[0], {}
    own = [p for p in members[0].parameters if p.per_record]
    if own:
        factors = strengths.reshape(len(members), -1)
        values = {f"{members[0].name}.{p.name}": np.array([float(getattr(m, p.field)) for m in members]) @ factors for p in own}
        return dataclasses.replace(members[0], **{p.field: 0.0 for p in own}), values
    scaled = [m.scaled(float(factor)) for m, factor in zip(members, strengths, strict=True)]
    return (scaled[0].probe.joined(scaled) if len(scaled) > 1 else scaled[0]), {}


def _states(scores: Scores, effect: AbstractEffect) -> dict[str, np.ndarray]:
    """The effect's own states at the knots, from rest at the start of every record, along the estimated motion."""
    if not effect.own_states:
        return {}
    chains = scores.fitted.problem.chains
    stacked = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64)[None], effect)
    found = np.zeros((chains.knot_count, len(effect.own_states)))
    for knots, course in zip(chains.knots, scores.courses, strict=True):
        own = own_states(stacked, [effect], course)[0]
        kept = np.asarray(effect.memory(course.readings, effect.read(course.readings, course.motion, own), own))
        rows = np.minimum(np.arange(knots.stop - knots.start) * chains.samples, len(kept) - 1)
        found[knots] = kept[rows]
    return _by_name(effect, found)


def _by_name(effect: AbstractEffect, states: np.ndarray) -> dict[str, np.ndarray]:
    """Own states of an effect by the names that the chain gives them, from (knots, states)."""
    return {f"{effect.name}.{state.name}": states[:, k] for k, state in enumerate(effect.own_states)}
