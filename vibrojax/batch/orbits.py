"""Periodic orbits of many operating points at once: Newton's method on the stroboscopic map, all points side by side."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from vibrojax.batch.points import LONG_SINCE
from vibrojax.batch.run import Strobes
from vibrojax.integrate.base import SUCCESS

_DISTURBED = 1e-5
"""Of A0, and of A0 Omega: how far the disturbed motions start off from which the monodromy matrix is taken. Larger by far than what the
engine's steps leave (1e-8 where the count of steps in a contact changes), and small beside what bends the map."""
_CLOSED = 1e-6
"""Of A0, and of A0 Omega: an orbit is found when the next Newton step would be shorter."""
_SLOW = 0.3
"""A step that is longer than this part of the one before asks for a new monodromy matrix."""
_REACH = 0.5
"""Of A0, and of A0 Omega: a step that is longer is taken for one to another orbit, and the start is lost."""
_STEPS = 6
"""Newton steps, at most."""
_NEAR_BORDER = 0.05
"""Where a stability condition is met or missed by less than this, the monodromy matrix is taken once more, at the orbit itself."""
_AWAY = 0.01
"""Of A0, and of A0 Omega: so it is where it was taken farther from the orbit."""
_SAME = 1e-4
"""Of A0, and of A0 Omega: closer section points are one; an orbit that repeats earlier has the shorter period."""

_ROWS = 8
"""Cycles for which a passage has room, at least: one program then serves all periods up to it."""


class Orbits(NamedTuple):
    """What Newton's method came to, one entry a start; without meaning where `found` is not."""

    found: Bool[np.ndarray, " starts"]
    """Whether it converged."""
    stable: Bool[np.ndarray, " starts"]
    """Whether both Floquet multipliers lie inside the unit circle."""
    state: Float[np.ndarray, "2 starts"]
    """u, m, and u', m/s, at a strobe."""
    strobes: Float[np.ndarray, "cycle 2 starts"]
    """The same at this and the next strobes, as many as the longest period has."""
    period: Int[np.ndarray, " starts"]
    """q, cycles; the shortest."""
    impacts: Int[np.ndarray, " starts"]
    """p in q cycles."""
    peak_force: Float[np.ndarray, " starts"]
    """Largest push of the stop, N."""


class _Passage(NamedTuple):
    """One period of each motion."""

    strobes: Float[np.ndarray, "cycles_and_start 2 lanes"]
    impacts: Int[np.ndarray, " lanes"]
    force: Float[np.ndarray, " lanes"]
    touch: Float[np.ndarray, "2 lanes"]
    """At the end: speed of the last touch, m/s, and time since, s, where in contact."""
    whole: Bool[np.ndarray, " lanes"]


def find_orbits(
    strobes: Strobes,
    index: Int[np.ndarray, " starts"],
    guess: Float[np.ndarray, "2 starts"],
    period: Int[np.ndarray, " starts"],
    scale: Float[np.ndarray, "2 starts"],
) -> Orbits:
    """Periodic orbits near guesses: x with P^q(x) = x, P the map from strobe to strobe, by Newton's method.

    x <- x - (M - 1)^-1 (P^q(x) - x), with the monodromy matrix M = dP^q/dx from two disturbed motions beside each guess. M is kept as
    long as the steps shrink fast. In contact at the strobe, the speed of the touch before, on which the force of some laws depends, is that
    at the end of the period before. Stable where |tr M| < 1 + det M and det M < 1 (Jury's conditions).

    For rigs without effects, whose map is the same in every cycle.

    Arguments:
        strobes: the rigs.
        index: lane of each start.
        guess: u, m, and u', m/s, at the strobe.
        period: q, cycles, at least 1.
        scale: A0, m, and A0 Omega, m/s, by which distances are measured.

    Source: Newton shooting as in `vibrojax.continuation.orbit`; conditions of E. I. Jury, Theory and application of the z-transform method
    (1964), for two multipliers.
    """
    count = index.size
    x, touch = guess / scale, np.stack([np.abs(guess[1]), np.full(count, LONG_SINCE)])
    matrix, last = np.zeros((2, 2, count)), np.full(count, np.inf)
    fresh, found, open_ = np.ones(count, bool), np.zeros(count, bool), np.ones(count, bool)
    away = np.zeros(count)
    longest = int(period.max(initial=1))
    passage = _Passage(np.zeros((longest + 1, 2, count)), np.zeros(count, int), np.zeros(count), touch.copy(), np.zeros(count, bool))
    for _ in range(_STEPS):
        here = np.flatnonzero(open_)
        if here.size == 0:
            break
        again = here[fresh[here]]
        which = np.concatenate([here, again, again])
        start = x[:, which]
        for axis in range(2):
            start[axis, here.size + axis * again.size :][: again.size] += _DISTURBED
        ran = _run(strobes, index[which], start * scale[:, which], touch[:, which], period[which], longest)
        for kept, part in zip(passage, ran, strict=True):
            kept[..., here] = part[..., : here.size]  # the undisturbed motions come first
        last_strobe = _at(ran.strobes, period[which]) / scale[:, which]
        for axis in range(2):
            beside = last_strobe[:, here.size + axis * again.size :][:, : again.size]
            matrix[:, axis, again] = (beside - last_strobe[:, : here.size][:, fresh[here]]) / _DISTURBED
        touch[:, here] = ran.touch[:, : here.size]
        step = _newton_step(matrix[:, :, here], last_strobe[:, : here.size] - x[:, here])
        length = np.abs(step).max(axis=0)
        away[again] = length[fresh[here]]
        closed = (length < _CLOSED) & passage.whole[here]
        lost = ~(length < _REACH) | ~passage.whole[here]
        fresh[here] = length > _SLOW * last[here]
        last[here] = length
        found[here[closed]] = True
        x[:, here] += np.where(closed | lost, 0.0, step)
        open_[here[closed | lost]] = False
    margins = _margins(matrix)
    unsure = np.flatnonzero(found & ((np.abs(margins).min(axis=0) < _NEAR_BORDER) | (away > _AWAY)))
    if unsure.size:
        there = _monodromy(strobes, index[unsure], x[:, unsure], touch[:, unsure], period[unsure], scale[:, unsure])
        margins[:, unsure] = _margins(there)
    stable = np.asarray((margins > 0).all(axis=0))
    return _shortest(passage, x * scale, found, stable, period, scale)


def same_orbit(strobes: Float[np.ndarray, "cycle 2 starts"], other: Float[np.ndarray, "2 starts"], scale: Float[np.ndarray, "2 starts"]):
    """Whether a section point lies on the orbit through those strobes."""
    return (np.abs((strobes - other) / scale).max(axis=1) < _SAME).any(axis=0)


def _run(strobes: Strobes, index: np.ndarray, start: np.ndarray, touch: np.ndarray, period: np.ndarray, longest: int) -> _Passage:
    """One period of each motion."""
    gap = np.asarray(jax.tree.unflatten(strobes.form, list(strobes.rigs)).systems.gap)[index]
    inside = start[0] > gap
    state = np.stack([*start, inside, touch[0], np.where(inside, touch[1], 0.0), np.zeros(index.size)]).astype(float)
    rows = max(_ROWS, longest)
    after, what = strobes.advance(index, state, period, rows)
    row = rows - period + np.minimum(np.arange(longest)[:, None], period - 1)
    u, v, impacts, force = (np.take_along_axis(what[name], row, axis=0) for name in ("u", "v", "impacts", "peak_force"))
    once = np.arange(longest)[:, None] < period
    touch = np.stack([after[3], np.where(after[4] > 0, after[4], LONG_SINCE)])
    points = np.concatenate([start[None], np.stack([u, v], axis=1)])
    return _Passage(points, (impacts * once).sum(axis=0), force.max(axis=0), touch, what["result"] == SUCCESS)


def _at(points: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Of each lane another row."""
    return np.take_along_axis(points, row[None, None, :], axis=0)[0]


def _newton_step(matrix: np.ndarray, miss: np.ndarray) -> np.ndarray:
    """-(M - 1)^-1 miss; not finite where M has the eigenvalue 1."""
    (a, b), (c, d) = matrix[0], matrix[1]
    a, d = a - 1.0, d - 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return -np.stack([d * miss[0] - b * miss[1], a * miss[1] - c * miss[0]]) / (a * d - b * c)


def _margins(matrix: np.ndarray) -> np.ndarray:
    """By how much each of the two stability conditions is met; negative where it is missed."""
    trace, det = matrix[0, 0] + matrix[1, 1], matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    return np.stack([1.0 + det - np.abs(trace), 1.0 - det])


def _monodromy(strobes: Strobes, index: np.ndarray, x: np.ndarray, touch: np.ndarray, period: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """At the orbit itself, by differences to both sides."""
    count, longest = index.size, int(period.max())
    ways = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    moved = np.concatenate([x + _DISTURBED * way[:, None] for way in ways], axis=1)
    four = np.tile(np.arange(count), 4)
    ran = _run(strobes, index[four], moved * scale[:, four], touch[:, four], period[four], longest)
    ends = (_at(ran.strobes, period[four]) / scale[:, four]).reshape(2, 4, count)
    return np.stack([ends[:, 0] - ends[:, 1], ends[:, 2] - ends[:, 3]], axis=1) / (2.0 * _DISTURBED)


def _shortest(passage: _Passage, state: np.ndarray, found: np.ndarray, stable: np.ndarray, period: np.ndarray, scale: np.ndarray) -> Orbits:
    """With the period after which each orbit repeats first."""
    short, impacts = period, passage.impacts
    for q in range(len(passage.strobes) - 1, 0, -1):
        repeats = (period % q == 0) & (np.abs((passage.strobes[q] - passage.strobes[0]) / scale).max(axis=0) < _SAME)
        impacts = np.where(repeats & (q < period), passage.impacts * q // period, impacts)
        short = np.where(repeats & (q < period), q, short)
    return Orbits(found, stable, state, passage.strobes[:-1], short, impacts, passage.force)
