"""Restart of windows that have converged to a wrong motion, from other initial states."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from identification.likelihood.joint import Point, point
from identification.likelihood.marginal import estimated_force
from identification.likelihood.variances import equations
from identification.windows.lanes import initial_states
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, windows_of

_WORSE = 4.0
"""Squared residual over the median of the windows above which one counts as diverged."""
_MOST = 0.2
"""Largest share of the windows that is restarted: where more are bad, the model is."""
_ITERATIONS = 4


def settled(here: Point) -> Point:
    """The same point with diverged windows refitted from several initial states; each keeps the best motion.

    The initial states are its own, the recorded one, and the end of the preceding window; the random force starts at zero.
    """
    each = here.deviation / np.maximum(here.inner.samples, 1)
    bad = np.flatnonzero(each > _WORSE * max(float(np.median(each)), 1.0))
    if not 0 < len(bad) <= _MOST * len(each):
        return here
    estimate, prepared = here.estimate, here.prepared
    part = windows_of(prepared, bad)
    read = np.concatenate([initial_states(group, prepared.motions) for group in part.groups])
    read = np.concatenate([read, estimate.states[bad, read.shape[1] :]], axis=1)
    nothing = np.zeros_like(estimate.force[bad])
    starts = [(estimate.states[bad], nothing), (read, nothing), (_continued(here)[bad], nothing)]
    states, force, best = estimate.states.copy(), estimate.force.copy(), here.deviation[bad]
    for trial_states, trial_force in starts:
        trial = dataclasses.replace(estimate, states=trial_states, force=trial_force)
        found = _alone(dataclasses.replace(part, start=trial), here, bad)
        better = found.deviation < best
        states[bad[better]], force[bad[better]] = found.estimate.states[better], found.estimate.force[better]
        best = np.where(better, found.deviation, best)
    if np.array_equal(states, estimate.states) and np.array_equal(force, estimate.force):
        return here
    return point(prepared, dataclasses.replace(estimate, states=states, force=force), here.variances)


def _alone(part: Prepared, here: Point, chosen: Int[np.ndarray, " windows"]) -> Point:
    """Fit states and random force of some windows, each with its own damping, all else fixed."""
    variances = dataclasses.replace(here.variances, weight=here.variances.weight[chosen])
    at, damping = point(part, part.start, variances), np.full(len(chosen), 1e-3)
    for _ in range(_ITERATIONS):
        trial = point(part, _stepped(at, damping), variances, like=at)
        better = trial.deviation < at.deviation
        kept = dataclasses.replace(
            at.estimate,
            states=np.where(better[:, None], trial.estimate.states, at.estimate.states),
            force=np.where(better[:, None], trial.estimate.force, at.estimate.force),
        )
        gained = np.where(np.isfinite(trial.deviation) & better, np.nan_to_num(at.deviation, posinf=1e300) - trial.deviation, 0.0)
        at = trial if better.all() else point(part, kept, variances, like=at)
        damping = np.where(better, damping / 10.0, damping * 10.0)
        if np.all(gained < 1.0):
            break
    return at


def _stepped(at: Point, damping: Float[np.ndarray, " windows"]) -> Estimate:
    count = at.estimate.states.shape[1]
    found = equations(at.linear, at.marginal, np.where(at.at.finite, 1.0, 0.0))
    block = found.hessian[:, -count:, -count:]
    block = block + damping[:, None, None] * block * np.eye(count) + 1e-300 * np.eye(count)
    move = -np.linalg.solve(block, found.gradient[:, -count:, None])[..., 0]
    move = np.where(np.isfinite(move), move, 0.0)
    step = np.concatenate([np.zeros((len(move), found.hessian.shape[1] - count)), move], axis=1)
    force, _ = estimated_force(at.inner, at.marginal, step)
    return dataclasses.replace(at.estimate, states=at.estimate.states + move, force=np.nan_to_num(force) * at.at.finite[:, None])


def _continued(here: Point) -> Float[np.ndarray, "windows states"]:
    """Initial states that continue the preceding window; unchanged where there is none or its integration failed."""
    at, states = here.at, here.estimate.states.copy()
    begins = {(record, first): window for window, (record, first) in enumerate(zip(at.record, at.first, strict=True))}
    for window, (record, first, length) in enumerate(zip(at.record, at.first, at.lengths, strict=True)):
        following = begins.get((record, first + length))
        if following is not None and at.finite[window]:
            step = at.ts[window, length - 1] - at.ts[window, length - 2]
            u, v = at.u[window, length - 1], at.v[window, length - 1]
            states[following, :2] = u + step * v, v
    return states
