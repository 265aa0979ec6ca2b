"""Held-back records under the parameters of a fit to the others: a chain of their own, its prediction, and the errors of forecasts.

A forecast begins at a filtered state, which knows the past of the record and not its future: at some instants the chain is solved for its
past alone. From the state there, the model runs freely, without random force.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.estimation.parameters import variations
from identification.estimation.prediction import Free, free_motion, frequency, pieces_of, record_fits
from identification.experiment import Experiment
from identification.result.result import Horizon, RecordFit
from identification.trajectory.elimination import solved
from identification.trajectory.fit import Fitted, Progress, fit
from identification.trajectory.motion import Estimate
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.remodel import remodelled, with_variation
from identification.trajectory.segments import OF_RECORD, Chains
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.variances import LARGEST_FORCE, Variances, vanishes
from vibrojax.channels import EVERY_CHANNEL

SIGNAL = 9.0
"""Ratio of a channel's variance to its noise variance below which the channel holds no signal to predict."""
PERIODS = (0.25, 1.0, 4.0)
"""How far the forecasts reach, in periods of the slower of suspension and drive."""


def held_back_chain(fitted: Fitted, experiment: Experiment, progress: Progress = lambda line: None) -> Fitted | None:
    """The held-back records with the shared parameters of a fit held; None where no record is held back.

    Estimated from them are their states, random force and reading errors, and each record's own numbers.
    """
    if not experiment.held_back:
        return None
    records = tuple(dataclasses.replace(record, held_back=False) for record in experiment.held_back)
    model = fitted.problem.model_at(fitted.at)
    problem = problem_of(dataclasses.replace(experiment, records=records, parameters={}), law=model.law.name)
    if model.effects:
        problem = remodelled(problem, problem.start, dataclasses.replace(problem.model, effects=model.effects))
        of = fitted.problem.scales
        problem = dataclasses.replace(problem, scales=dataclasses.replace(problem.scales, own=of.own, own_initial=of.own_initial))
    varying = {name: float(fitted.problem.border.own_scale[place]) for name, place in variations(fitted.problem).items()}
    problem = with_variation(problem, varying)
    shared = np.array([fitted.at.shared[fitted.problem.unknowns.index(name)] for name, _ in problem.unknowns.shared])
    own = problem.border.own.copy()
    own[:, OF_RECORD.index("gap_error")] = problem.model.has_stop  # that of a missing stop is held, and says nothing of these gaps
    held = dataclasses.replace(problem.border, shared=np.zeros(len(shared), bool), own=own)
    problem = dataclasses.replace(problem, border=held, start=dataclasses.replace(problem.start, shared=shared))
    begin = _begin(fitted, problem)
    found = fit(problem, begin=begin, both=begin is None, progress=progress)
    return found if found.converged or begin is None else fit(problem, begin=begin, progress=progress)


def _begin(fitted: Fitted, held_back: Problem) -> Variances | None:
    """Variances that held-back records begin with: those of the fit; None where it has no random force: these may have one."""
    force = fitted.variances.force
    if vanishes(fitted.problem, force):
        return None
    known = dict(zip(fitted.problem.chains.channels, fitted.variances.readings, strict=True))
    return Variances(
        force=dataclasses.replace(force, std=min(force.std, LARGEST_FORCE * held_back.scales.force)),
        readings=tuple(known.get(channel, ReadingError()) for channel in held_back.chains.channels),
    )


def held_back_fits(chain: Fitted | None) -> tuple[RecordFit, ...]:
    """Records of a held-back chain, in their order, with their predictions and the errors of forecasts; none without a chain."""
    if chain is None:
        return ()
    return tuple(dataclasses.replace(one, horizons=far) for one, far in zip(record_fits(chain), horizons(chain), strict=True))


def rms_nrmse(records: tuple[RecordFit, ...]) -> float:
    """Root mean square of the normalised errors over all channels with signal.

    A prediction that is off by more than the signal itself has failed, and counts as 1: how far off a motion ends up that parts from the
    recorded one, as a chaotic one does, says nothing of the model.
    """
    errors = [error for record in records for channel, error in record.nrmse.items() if has_signal(record, channel)]
    return float(np.sqrt(np.mean(np.minimum(np.nan_to_num(errors, nan=1.0), 1.0) ** 2))) if errors else float("nan")


def has_signal(record: RecordFit, channel: str) -> bool:
    """Whether a channel's variance exceeds that of its noise by the factor `SIGNAL`."""
    return bool(np.nanvar(record.measured[channel]) > SIGNAL * record.noise[channel] ** 2)


def horizons(fitted: Fitted) -> tuple[tuple[Horizon, ...], ...]:
    """Errors of the forecasts of every record, by horizon; the last one is that of the free motion from its first state.

    An error is the root mean square over the quarter of a period before the horizon, over the channel's standard deviation.
    """
    problem, at, found = fitted.problem, fitted.at, []
    pieces, segments = pieces_of(problem, at)
    for index, record in enumerate(problem.experiment.records):
        part, hz = pieces.of_record(index), frequency(problem, at, record)
        count, duration = part.stop - part.start, float(np.median(pieces.duration[part]))
        reach = {periods: max(1, round(periods / (hz * duration))) for periods in PERIODS} if hz > 0 else {}
        past = max(1, round(1.0 / (hz * duration))) if hz > 0 else count  # a period, which determines a state
        starts = np.unique(np.linspace(past, count - 1, 24).astype(int)) if past < count else np.zeros(0, int)  # 24 at most
        begin = np.concatenate([[0], starts])
        first = fitted.at.states[problem.chains.knots[index].start]
        states = np.stack([first, *(filtered_state(fitted, index, int(start) * segments) for start in starts)])
        longest = np.minimum(np.where(begin > 0, max(reach.values(), default=0), count), count - begin)
        runs = list(free_motion(problem, at, pieces, part.start + begin, longest, states))
        length = [one.piece - part.start - begin[one.run] + 1 for one in runs]
        ahead = {p: [one for one, far in zip(runs, length, strict=True) if one.run > 0 and far == reach[p]] for p in reach}
        rows = [
            Horizon(periods=periods, seconds=reach[periods] * duration, nrmse=_errors(fitted, index, pieces, chosen))
            for periods, chosen in ahead.items()
            if chosen
        ]
        whole = [r for r in runs if r.run == 0]
        found.append((*rows, Horizon(periods=None, seconds=count * duration, nrmse=_errors(fitted, index, pieces, whole))))
    return tuple(found)


def filtered_state(fitted: Fitted, index: int, segments: int) -> Float[np.ndarray, " states"]:
    """State of a record at the knot behind so many of its segments, from the readings before, with all numbers but the states held."""
    problem, at = fitted.problem, fitted.at
    size, mine = len(problem.unknowns.states) + 1, np.zeros(len(problem.chains.record), bool)
    mine[problem.chains.of_record(index).start :][:segments] = True
    past, knots, one = problem.chains.part(mine)
    gram, right, defect = fitted.local.gram[mine], fitted.local.right[mine], fitted.local.defect[mine]  # copies
    gram[:, 3 * size :], gram[:, :, 3 * size :], right[:, 3 * size :], defect[..., 3 * size :] = 0.0, 0.0, 0.0, 0.0
    local = dataclasses.replace(
        fitted.local, gram=gram, right=right, defect=defect, gap=fitted.local.gap[mine], linked=fitted.local.linked[mine]
    )
    border = problem.border
    border = dataclasses.replace(
        border,
        shared=np.zeros_like(border.shared),
        own=np.zeros_like(border.own[one]),
        own_mean=border.own_mean[one],
        own_precision=border.own_precision[one],
    )
    estimate = Estimate(states=at.states[knots], force=at.force[knots], shared=at.shared, own=at.own[one])
    found = solved(dataclasses.replace(problem, chains=past, border=border), estimate, local, fitted.variances.force)
    return estimate.states[-1] + found.knots[-1, :-1]


def _errors(fitted: Fitted, index: int, pieces: Chains, runs: list[Free]) -> dict[str, float]:
    """Normalised errors of some pieces of a record by channel; NaN where none could be integrated."""
    problem = fitted.problem
    record = problem.experiment.records[index]
    found = {}
    for column, name in enumerate(problem.chains.channels):
        if name not in record.channels or not (pieces.weight[pieces.of_record(index)][..., column] > 0).any():
            continue
        place = EVERY_CHANNEL.index(name)
        squares = [
            ((one.readings[:, place] - pieces.measured[one.piece, :, column]) ** 2)[pieces.weight[one.piece, :, column] > 0] for one in runs
        ]
        error = float(np.sqrt(np.mean(np.concatenate(squares)))) if squares and sum(map(len, squares)) else float("nan")
        spread = float(np.nanstd(record.channels[name]))
        found[name] = error / spread if spread > 0 else float("nan")
    return found
