"""Errors of forecasts by how far they reach: from filtered states, which know the record's past and not its future.

At some instants of a record the chain is solved for its past alone. From the state there, the model runs freely, without random force.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.estimation.prediction import Free, free_motion, frequency, pieces_of
from identification.result.result import Horizon
from identification.trajectory.elimination import solve
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import Chains
from vibrojax.channels import EVERY_CHANNEL

PERIODS = (0.25, 1.0, 4.0)
"""How far the forecasts reach, in periods of the slower of suspension and drive."""
_STARTS = 24
"""Forecasts of a record, at most."""


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
        past = max(1, round(1.0 / (hz * duration))) if hz > 0 else count  # a period, from which a state can be told
        starts = np.unique(np.linspace(past, count - 1, _STARTS).astype(int)) if past < count else np.zeros(0, int)
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
    problem, chains, at = fitted.problem, fitted.problem.chains, fitted.at
    begin, size = chains.of_record(index).start, len(problem.unknowns.states) + 1
    mine, knots = slice(begin, begin + segments), slice(chains.knots[index].start, chains.knots[index].start + segments + 1)
    past = dataclasses.replace(
        chains,
        groups=(),
        record=np.zeros(segments, int),
        left=np.arange(segments),
        first=chains.first[mine],
        duration=chains.duration[mine],
        knots=(slice(0, segments + 1),),
        files=(chains.files[index],),
        measured=chains.measured[mine],
        weight=chains.weight[mine],
    )
    gram, right, defect = fitted.local.gram[mine].copy(), fitted.local.right[mine].copy(), fitted.local.defect[mine].copy()
    gram[:, 3 * size :], gram[:, :, 3 * size :], right[:, 3 * size :], defect[..., 3 * size :] = 0.0, 0.0, 0.0, 0.0
    local = dataclasses.replace(
        fitted.local, gram=gram, right=right, defect=defect, gap=fitted.local.gap[mine], linked=fitted.local.linked[mine]
    )
    border, one = problem.border, slice(index, index + 1)
    border = dataclasses.replace(
        border,
        shared=np.zeros_like(border.shared),
        own=np.zeros_like(border.own[one]),
        own_mean=border.own_mean[one],
        own_precision=border.own_precision[one],
    )
    estimate = Estimate(states=at.states[knots], force=at.force[knots], shared=at.shared, own=at.own[one])
    found = solve(past, problem.unknowns, border, problem.scales, estimate, local, fitted.variances.force, problem.experiment.mass)
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
