"""Lyapunov exponents of the stroboscopic map, by twin lanes."""

import dataclasses
import os
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax import lax
from jaxtyping import Array, Float

from vibrojax.batch import AbstractEngine, Lanes, LaneState, Points, Span, engine_for, grid, integrate
from vibrojax.batch.points import lanes_of
from vibrojax.compiling import compiled_for_long_runs
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, Values, axis, labelled, outcome
from vibrojax.system import System

_APART = 1e-7
"""Distance of twins at the start of a cycle: far above rounding, far below the orbit."""
_TOGETHER = 5
"""Cycles between two looks at a twin where it has no other to be orthogonal to: it stays small beside the orbit meanwhile."""
_SIDE_BY_SIDE = 32
"""Lanes that are stepped side by side, each with its twins."""
_STROBES = 100
"""Section points at each value, at least: chaos shows as a cloud."""


def exponents(
    model: Model,
    points: Points,
    state: LaneState,
    chosen: np.ndarray,
    *,
    cycles: int,
    number: int = 1,
    threads: int | None = None,
) -> np.ndarray:
    """Largest Lyapunov exponents per cycle of excitation of some lanes, from states on their attractors, `(chosen, number)`.

    Each lane has a twin for each exponent, which starts a small distance off. After every cycle, of one exponent after every five, the
    logarithm of the growth of that distance is noted, and the twin is put back to the small distance in the direction that it has gone,
    made orthogonal to those of the twins before it. Distances are measured over A0 in u, A0 Omega in u', and the usual size of every
    state of an effect, or A0.

    Arguments:
        model: the rig.
        points: of all lanes.
        state: of all lanes, at a strobe.
        chosen: which lanes, `(lanes,)`.
        number: how many exponents; at most the number of states.
        cycles: averaged over, after a tenth as many that turn the twins into the fastest direction.
        threads: chunks at a time; by default one a core.

    Source: G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Phys. Rev. A 14 (1976) 2338-2345.
    """
    lanes, _ = lanes_of(model, points)
    engine, index = engine_for(lanes), np.flatnonzero(chosen)
    everyone = jax.tree.map(np.asarray, (lanes, state, _scales(model, points)))
    pieces = [index[i : i + _SIDE_BY_SIDE] for i in range(0, index.size, _SIDE_BY_SIDE)]

    def one(piece: np.ndarray) -> np.ndarray:
        full = np.concatenate([piece, np.full(_SIDE_BY_SIDE - piece.size, piece[-1])])
        rigs, start, scale = jax.tree.map(lambda leaf: leaf[full], everyone)
        return np.asarray(_growth(engine, rigs, start, scale, cycles, number))[: piece.size]

    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0))) as pool:
        return np.concatenate(list(pool.map(one, pieces)))


def _scales(model: Model, points: Points) -> np.ndarray:
    """Sizes by which u, u' and the effects' own states are measured, (lanes, states)."""
    values = points.flat()
    amplitude, omega = values["base_amplitude"], 2.0 * np.pi * values["frequency_hz"]
    own = [np.full(points.lanes, one.scale) if one.scale else amplitude for effect in model.rig.effects for one in effect.own_states]
    return np.stack([amplitude, amplitude * omega, *own], axis=1)


@compiled_for_long_runs
def _growth(
    engine: AbstractEngine, lanes: Lanes, state: LaneState, scale: Float[Array, "lanes states"], cycles: int, number: int
) -> Float[Array, "lanes exponents"]:
    """Mean logarithms of the growth per cycle."""
    count, size = scale.shape
    every = _TOGETHER if number == 1 else 1
    skipped, parts = max(cycles // (10 * every), 1), -(-cycles // every)

    def spread(tree):
        """Every lane, and behind all of them as many twins of each."""
        return jax.tree.map(lambda leaf: jnp.concatenate([leaf] * (number + 1)), tree)

    everyone = spread(lanes)

    def cycle(carry, passed):
        state, apart, total = carry
        group = spread(state)
        x = _states(group).at[count:].add((apart * scale[None]).reshape(-1, size))
        u, v, own = x[:, 0], x[:, 1], x[:, 2:]
        t = group.cycle.astype(u.dtype) / everyone.frequency_hz
        near = jax.vmap(System.approach)(everyone.systems, t, u, v, own)
        after, _ = engine.advance(everyone, group._replace(u=u, v=v, own=own, in_contact=near.indentation > 0), every, 1)
        ends = _states(after)
        apart = (ends[count:].reshape(number, count, size) - ends[None, :count]) / scale[None]
        directions, lengths = [], []
        for one in apart:
            for other in directions:
                one = one - jnp.sum(one * other, axis=1, keepdims=True) * other
            lengths.append(jnp.maximum(jnp.linalg.norm(one, axis=1), 1e-300))
            directions.append(one / lengths[-1][:, None])
        total = total + jnp.where(passed >= skipped, jnp.log(jnp.stack(lengths) / _APART), 0.0)
        return (jax.tree.map(lambda leaf: leaf[:count], after), _APART * jnp.stack(directions), total), None

    along = np.linalg.qr(np.cos(1.0 + np.outer(np.arange(size), 1.0 + np.arange(number))))[0].T  # along no axis
    apart = jnp.broadcast_to(jnp.asarray(_APART * along)[:, None, :], (number, *scale.shape))
    (_, _, total), _ = lax.scan(cycle, (state, apart, jnp.zeros((number, count))), jnp.arange(parts + skipped))
    return total.T / (parts * every)


def _states(state: LaneState) -> Float[Array, "lanes states"]:
    return jnp.concatenate([state.u[:, None], state.v[:, None], state.own], axis=1)


def lyapunov(
    model: Model,
    *,
    parameter: str,
    values: Values,
    base_amplitude: float,
    span: Span | None = None,
    cycles: int = 300,
    threads: int | None = None,
    **fixed: float,
) -> xr.Dataset:
    """Both Lyapunov exponents along a parameter, of the motion that is reached from rest: the largest is above zero in chaos.

    Arguments:
        model: the rig.
        parameter: what varies.
        values: its values.
        base_amplitude: A0, m.
        span: that leads to the attractor.
        cycles: averaged over.
        threads: chunks of lanes at a time; by default one a core.
        fixed: the other settings.

    Returns:
        `exponent` and `second_exponent`, per cycle of excitation, NaN where the motion could not be integrated, and the section points
        `displacement`, at least 100.
    """
    points = grid({parameter: values}, base_amplitude=base_amplitude, **fixed)
    span = span or Span()
    span = dataclasses.replace(span, closed=None, recorded=max(span.recorded, _STROBES))
    found = integrate(model, points, span=span, threads=threads)
    growth = exponents(model, points, found.state, np.ones(points.lanes, dtype=bool), cycles=cycles, number=2, threads=threads)
    growth = np.where(found.result == SUCCESS, growth.T, np.nan)
    return labelled(
        f"Lyapunov exponents along {parameter}",
        model,
        found,
        coords={parameter: axis(model, parameter, points.coords[parameter])},
        variables={
            "exponent": Labelled((parameter,), growth[0], "1", "largest Lyapunov exponent per cycle of excitation"),
            "second_exponent": Labelled((parameter,), growth[1], "1", "second Lyapunov exponent per cycle of excitation"),
            "displacement": Labelled((parameter, "cycle"), found.u, "m", "displacement at the strobes"),
            **outcome((parameter,), found.result),
        },
        settings={"base_amplitude": base_amplitude, "parameter": parameter, "cycles": cycles} | fixed,
    )
