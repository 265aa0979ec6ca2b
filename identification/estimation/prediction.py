"""Records beside the motion that a fitted model makes of them without the random force.

A record is cut into stretches. Each is integrated in one go from the fitted state at its beginning, with the record's own numbers and no
random force: what the model alone predicts. Where the hammer strikes a stop, an error of the state grows from impact to impact, so that a
stretch is `PERIODS` long, counted by the slower of suspension and drive (`BRIEF` where models with a random force are compared). A
vibration without impacts is one stretch, from the state with which it follows the whole record best: beside a random force, a state is
known from the samples near it alone.

Where no random force is left, chi-square is that of the smoothed motion, unless impacts follow each other in the free one: noise of a
recorded input moves the hammer off the free motion, and a long flight without a spring shows the smallest force that a fit leaves.
"""

import dataclasses
from collections.abc import Collection, Iterator
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from identification.experiment import Record
from identification.guesses.motion import driving_channels, input_noise
from identification.result.result import Quantity, RecordFit
from identification.trajectory.fit import Fitted, settled
from identification.trajectory.motion import Estimate, homes, shown, travelled
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.segments import OF_RECORD, Chains, chains_of, not_shown
from identification.trajectory.start import Problem
from identification.trajectory.variances import SMALLEST_FORCE, Variances, vanishes
from vibrojax.channels import EVERY_CHANNEL, UNITS
from vibrojax.compiling import soon_compiled

PERIODS = 4.0
"""Length of a stretch with impacts: some impacts, over which an error of the state grows without taking the motion elsewhere."""
BRIEF = 0.25
"""Length of a brief one, in periods of the drive, or of the suspension where there is none: an impact at most, or two."""
LANES = 64
"""Motions that are integrated side by side."""


class Free(NamedTuple):
    """What the model does in one piece, by its place among all pieces, of one free motion (`run`); readings as `EVERY_CHANNEL` has them."""

    run: int
    piece: int
    readings: Float[np.ndarray, "samples channels"]
    u: Float[np.ndarray, " samples"]
    v: Float[np.ndarray, " samples"]
    in_contact: Bool[np.ndarray, " samples"]


@soon_compiled
def _free(model, unknowns, files, integrator, pieces, vectors):
    systems, along, last = travelled(model, unknowns, files, integrator, pieces, vectors)
    value, done = shown(unknowns, pieces, vectors, systems, along, last)
    u, v, in_contact = (values[:, :-1] for values in (along.u, along.v, along.in_contact))
    return value, u, v, in_contact, done


def pieces_of(problem: Problem, at: Estimate, *, brief: bool = False) -> tuple[Chains, int]:
    """The records in pieces of some segments each, about a quarter of the slowest period, and how many segments a piece has.

    A power of two, so that another number in the model seldom makes another program. For brief stretches a sixteenth of the fastest period.
    """
    records, duration = problem.experiment.records, float(np.median(problem.chains.duration))
    found = [one for record in records if (one := brief_frequency(problem, record) if brief else frequency(problem, at, record)) > 0]
    wanted = 16.0
    if found:
        wanted = 1.0 / ((16.0 * max(found) if brief else 4.0 * min(found)) * duration)
    segments = 2 ** max(0, round(np.log2(wanted)))
    return chains_of(problem.experiment.records, problem.chains.samples * segments, rest=problem.rest), segments


def frequency(problem: Problem, at: Estimate, record: Record) -> float:
    """The slower of suspension and drive, Hz; 0 where there is neither."""
    both = (problem.values(at).get("f_n", 0.0), record.excitation_frequency or 0.0)
    return min((one for one in both if one > 0), default=0.0)


def brief_frequency(problem: Problem, record: Record) -> float:
    """Of the drive, else the first guess of that of the suspension, Hz, so that models are compared over one length; 0 without either."""
    return record.excitation_frequency or problem.values(problem.start).get("f_n", 0.0)


def free_motion(
    problem: Problem,
    at: Estimate,
    pieces: Chains,
    begin: Int[np.ndarray, " runs"],
    count: Int[np.ndarray, " runs"],
    states: Float[np.ndarray, "runs states"],
) -> Iterator[Free]:
    """Integrate from given states, without random force, from the piece that each run begins with over so many; a run that fails ends."""
    model = jax.tree.map(np.asarray, problem.model_at(at))
    where = {int(place): (index, row) for index, group in enumerate(pieces.groups) for row, place in enumerate(group.place)}
    current, running = states.copy(), np.ones(len(begin), bool)
    for step in range(int(count.max(initial=0))):
        running &= step < count
        for index, group in enumerate(pieces.groups):
            mine = np.array([run for run in np.flatnonzero(running) if where[int(begin[run]) + step][0] == index], int)
            for first in range(0, len(mine), LANES):
                runs = np.resize(mine[first : first + LANES], LANES)
                rows = np.array([where[int(begin[run]) + step][1] for run in runs])
                chunk = jax.tree.map(lambda leaf, rows=rows: leaf[rows], group)
                nothing = np.zeros((LANES, 0, 0))
                chunk = dataclasses.replace(chunk, measured=nothing, weight=nothing, channels=EVERY_CHANNEL)
                vectors = np.concatenate(
                    [current[runs], np.zeros((LANES, 2)), np.broadcast_to(at.shared, (LANES, len(at.shared))), at.own[chunk.record]],
                    axis=1,
                )
                found = _free(model, problem.unknowns, homes(model, problem.chains.files), problem.integrator, chunk, vectors)
                value, u, v, in_contact, done = jax.tree.map(np.asarray, found)
                for lane, run in enumerate(mine[first : first + LANES]):
                    current[run], running[run] = value.end[lane], running[run] and done[lane]
                    if done[lane]:
                        yield Free(int(run), int(begin[run]) + step, value.readings[lane], u[lane], v[lane], in_contact[lane])


def record_fits(fitted: Fitted, chosen: Collection[int] | None = None, *, brief: bool = False) -> tuple[RecordFit, ...]:
    """Records of a fit with their prediction: all, or the chosen ones, in order; those with impacts over `BRIEF` where `brief`."""
    places = list(range(len(fitted.problem.chains.files))) if chosen is None else sorted(chosen)
    found, followed = _predicted(fitted, places, fitted.at.states, brief=brief), _following(fitted, places)
    if followed is None:
        return found
    pairs = zip(found, _predicted(fitted, places, followed, brief=brief), strict=True)
    return tuple(min(pair, key=lambda one: np.nan_to_num(sum(one.chi2_reduced.values()), nan=np.inf, posinf=np.inf)) for pair in pairs)


def _predicted(
    fitted: Fitted, places: list[int], states: Float[np.ndarray, "knots states"], *, brief: bool = False
) -> tuple[RecordFit, ...]:
    """Records with the motion from given states at the beginnings of their stretches."""
    problem, at = fitted.problem, fitted.at
    pieces, segments = pieces_of(problem, at, brief=brief)
    stretches = [_stretches(problem, at, index, pieces, brief) for index in places]
    begin, count = (np.concatenate(part) for part in zip(*stretches, strict=True))
    first = np.array([pieces.of_record(index).start for index in range(len(pieces.files))])
    owner = pieces.record[begin]
    knots = np.array([problem.chains.knots[index].start for index in owner]) + segments * (begin - first[owner])
    samples = pieces.samples
    series = {name: np.full((len(pieces.record), samples), np.nan) for name in (*EVERY_CHANNEL, "relative_velocity", "u")}
    contact = np.zeros((len(pieces.record), samples), bool)
    for one in free_motion(problem, at, pieces, begin, count, states[knots]):
        for column, name in enumerate(EVERY_CHANNEL):
            series[name][one.piece] = one.readings[:, column]
        series["u"][one.piece], series["relative_velocity"][one.piece], contact[one.piece] = one.u, one.v, one.in_contact
    window = np.zeros((len(pieces.record), samples), int)
    for number, (piece, length) in enumerate(zip(begin, count, strict=True)):
        window[piece : piece + length] = number

    def along(index: int, record: Record) -> RecordFit:
        def of(values: np.ndarray) -> np.ndarray:
            return pieces.series(index, values, len(record.time))

        predicted = {name: of(series[name]) for name in EVERY_CHANNEL}
        return _record_fit(fitted, index, predicted, of(series["u"]), of(series["relative_velocity"]), of(contact), of(window))

    return tuple(along(index, problem.experiment.records[index]) for index in places)


def _following(fitted: Fitted, places: list[int]) -> Float[np.ndarray, "knots states"] | None:
    """States with those of least squares at the beginning of vibrations without impacts; None where there is nothing to change."""
    problem, at, variances = fitted.problem, fitted.at, fitted.variances
    alone = [problem.chains.knots[index].start for index in places if not strikes(problem, at, index)]
    if not alone or vanishes(problem, variances.force):
        return None
    held = dataclasses.replace(problem.border, shared=np.zeros_like(problem.border.shared), own=np.zeros_like(problem.border.own))
    force = RandomForce(std=SMALLEST_FORCE * problem.scales.force, memory=variances.force.memory)
    none = Variances(force=force, readings=tuple(ReadingError(innovation=one.std) for one in variances.readings))
    try:
        follows = settled(dataclasses.replace(problem, border=held), at, none).at.states
    except np.linalg.LinAlgError:  # a wrong model may not follow the record at all
        return None
    found = at.states.copy()
    found[alone] = follows[alone]
    return found


def strikes(problem: Problem, at: Estimate, index: int) -> bool:
    """Whether the hammer touches the stop in a record, as recorded or as fitted."""
    motion, gap = problem.motions[index], problem.experiment.records[index].gap + at.own[index, OF_RECORD.index("gap_error")]
    recorded = motion is not None and bool(motion.touching.any())
    return recorded or bool((at.states[problem.chains.knots[index], 0] > gap).any())


def _stretches(problem: Problem, at: Estimate, index: int, pieces: Chains, brief: bool) -> tuple[np.ndarray, np.ndarray]:
    """First piece of each stretch of a record, and how many it has."""
    part, record = pieces.of_record(index), problem.experiment.records[index]
    hz, periods = (brief_frequency(problem, record), BRIEF) if brief else (frequency(problem, at, record), PERIODS)
    length, whole = float(np.median(pieces.duration[part])), part.stop - part.start
    each = max(1, round(periods / (hz * length))) if hz > 0 and strikes(problem, at, index) else whole
    begin = np.arange(part.start, part.stop, each)
    return begin, np.minimum(each, part.stop - begin)


def _record_fit(
    fitted: Fitted,
    index: int,
    predicted: dict[str, np.ndarray],
    u: np.ndarray,
    v: np.ndarray,
    in_contact: Bool[np.ndarray, " samples"],
    window: np.ndarray,
) -> RecordFit:
    """One record with its prediction; where the model fails, a channel's mean is the prediction that the errors are of."""
    record, gap_error = fitted.problem.experiment.records[index], fitted.at.own[index, OF_RECORD.index("gap_error")]
    nrmse, chi2 = {}, {}
    for name in EVERY_CHANNEL:
        if name not in record.channels or name in driving_channels(record):
            continue
        measured = np.where(not_shown(name, record.channels[name]), np.nan, record.channels[name])
        error = measured - np.where(np.isfinite(predicted[name]), predicted[name], np.nanmean(measured))
        rms, spread = float(np.sqrt(np.nanmean(error**2))), float(np.nanstd(record.channels[name]))
        nrmse[name], chi2[name] = rms / spread if spread > 0.0 else np.nan, (rms / record.noise[name]) ** 2
    smoothed = any(input_noise(record)) or not strikes(fitted.problem, fitted.at, index)
    if smoothed and vanishes(fitted.problem, fitted.variances.force):
        chi2 = {name: value for name, value in _smoothed_chi2(fitted, index).items() if name in chi2}
    return RecordFit(
        file=record.file,
        kind=record.kind,
        gap=record.gap + gap_error,
        nuisances=tuple(_nuisances(fitted, index)),
        time=record.time,
        measured={name: record.channels[name] for name in EVERY_CHANNEL if name in record.channels},
        predicted=predicted,
        noise=dict(record.noise),
        nrmse=nrmse,
        chi2_reduced=chi2,
        relative_displacement=u,
        relative_velocity=v,
        in_contact=in_contact,
        window=window,
        notices=record.notices,
    )


def _smoothed_chi2(fitted: Fitted, index: int) -> dict[str, float]:
    """Mean squared residual of the smoothed motion over the noise variance, by channel of a record."""
    chains = fitted.problem.chains
    part = chains.of_record(index)
    counts, squares = chains.weight[part] > 0, fitted.linear.residual[part] ** 2
    return {name: float(np.mean(squares[..., c][counts[..., c]])) for c, name in enumerate(chains.channels) if counts[..., c].any()}


def _nuisances(fitted: Fitted, index: int) -> Iterator[Quantity]:
    """Numbers that were estimated for one record, SI; sine and cosine of the cart as amplitude and phase."""
    problem, unknowns = fitted.problem, fitted.problem.unknowns
    free, values = problem.border.own[index], fitted.at.own[index]
    errors = fitted.solution.own_error[index] * problem.border.own_scale
    if free[0] and free[1]:
        (sine, cosine), (of_sine, of_cosine) = values[:2], errors[:2]
        amplitude = float(np.hypot(sine, cosine))
        across = float(np.hypot(cosine * of_sine, sine * of_cosine)) / max(amplitude, 1e-300)
        along = float(np.hypot(sine * of_sine, cosine * of_cosine)) / max(amplitude, 1e-300)
        yield Quantity(name="base_amplitude", unit="m", value=amplitude, stderr=along)
        yield Quantity(name="base_phase", unit="rad", value=float(np.arctan2(cosine, sine)), stderr=across / max(amplitude, 1e-300))
    listed = {p.name: p for p in (*problem.parameters, *problem.model.record_parameters)}
    for place in range(OF_RECORD.index("gap_error"), len(values)):
        name, value, error = unknowns.own[place], float(values[place]), float(errors[place])
        if not free[place]:
            continue
        kind, _, of = name.partition(".")
        if name == "gap_error":
            unit = "m"
        elif kind == "zero":
            unit = UNITS[of]
        else:
            spec = listed[of if kind == "variation" else name]
            unit = "1" if kind == "variation" and spec.logarithmic else spec.unit
        if unknowns.logarithmic_own[place]:
            value = float(np.exp(value))
            error *= value
        yield Quantity(name=name, unit=unit, value=value, stderr=error)
