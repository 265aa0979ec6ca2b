"""Largest Lyapunov exponent of the stroboscopic map, by twin lanes."""

import dataclasses
import os
from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax import lax
from jaxtyping import Array, Float

from vibrojax.batch import AbstractEngine, Lanes, LaneState, Points, Span, engine_for, grid, integrate
from vibrojax.batch.points import lanes_of
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, Values, axis, labelled, outcome
from vibrojax.system import System

_APART = 1e-7
"""Distance of twins at the start of a cycle: far above rounding, far below the orbit."""


def exponents(
    model: Model, points: Points, state: LaneState, chosen: np.ndarray, *, cycles: int, chunk: int = 32, threads: int | None = None
) -> np.ndarray:
    """Largest Lyapunov exponent per cycle of excitation of some lanes, from states on their attractors.

    Each lane has a twin that starts a small distance off. After every cycle the logarithm of the growth of that distance is noted, and the
    twin is put back to the small distance in the direction that it has gone. Distances are measured over A0 in u, A0 Omega in u', and the
    usual size of every state of an effect, or A0.

    Arguments:
        model: the rig.
        points: of all lanes.
        state: of all lanes, at a strobe.
        chosen: which lanes, `(lanes,)`.
        cycles: averaged over, after a tenth as many that turn the twins into the fastest direction.
        chunk: lanes that are stepped side by side, each with its twin.
        threads: chunks at a time; by default one a core.

    Source: G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Phys. Rev. A 14 (1976) 2338-2345.
    """
    lanes, _ = lanes_of(model, points)
    engine, index = engine_for(lanes), np.flatnonzero(chosen)
    scales = _scales(model, points)
    pieces = [index[i : i + chunk] for i in range(0, index.size, chunk)]

    def one(piece: np.ndarray) -> np.ndarray:
        full = jnp.asarray(np.concatenate([piece, np.full(chunk - piece.size, piece[-1])]))
        rigs, start, scale = jax.tree.map(lambda leaf: leaf[full], (lanes, state, jnp.asarray(scales)))
        return np.asarray(_growth(engine, rigs, start, scale, cycles))[: piece.size]

    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0))) as pool:
        return np.concatenate(list(pool.map(one, pieces)))


def _scales(model: Model, points: Points) -> np.ndarray:
    """Sizes by which u, u' and the effects' own states are measured, (lanes, states)."""
    values = points.flat()
    amplitude, omega = values["base_amplitude"], 2.0 * np.pi * values["frequency_hz"]
    own = [np.full(points.lanes, one.scale) if one.scale else amplitude for effect in model.rig.effects for one in effect.own_states]
    return np.stack([amplitude, amplitude * omega, *own], axis=1)


@eqx.filter_jit
def _growth(
    engine: AbstractEngine, lanes: Lanes, state: LaneState, scale: Float[Array, "lanes states"], cycles: int
) -> Float[Array, " lanes"]:
    """Mean logarithm of the growth per cycle."""
    count, size = scale.shape
    both = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), lanes)
    skipped = max(cycles // 10, 1)

    def cycle(carry, number):
        state, apart, total = carry
        pair = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), state)
        x = _states(pair).at[count:].add(apart * scale)
        u, v, own = x[:, 0], x[:, 1], x[:, 2:]
        t = pair.cycle.astype(u.dtype) / both.frequency_hz
        near = jax.vmap(System.approach)(both.systems, t, u, v, own)
        after, _ = engine.advance(both, pair._replace(u=u, v=v, own=own, in_contact=near.indentation > 0), 1, 1)
        apart = (_states(after)[count:] - _states(after)[:count]) / scale
        length = jnp.maximum(jnp.linalg.norm(apart, axis=1), 1e-300)
        total = total + jnp.where(number >= skipped, jnp.log(length / _APART), 0.0)
        return (jax.tree.map(lambda leaf: leaf[:count], after), apart * _APART / length[:, None], total), None

    along = np.cos(1.0 + np.arange(size))  # along no axis
    start = (state, jnp.broadcast_to(jnp.asarray(_APART * along / np.linalg.norm(along)), scale.shape), jnp.zeros(count))
    (_, _, total), _ = lax.scan(cycle, start, jnp.arange(cycles + skipped))
    return total / cycles


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
    """Largest Lyapunov exponent along a parameter, of the motion that is reached from rest: above zero in chaos.

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
        `exponent`, per cycle of excitation, NaN where the motion could not be integrated, and the section points `displacement`.
    """
    points = grid({parameter: values}, base_amplitude=base_amplitude, **fixed)
    span = dataclasses.replace(span or Span(), closed=None)
    found = integrate(model, points, span=span, threads=threads)
    growth = exponents(model, points, found.state, np.ones(points.lanes, dtype=bool), cycles=cycles, threads=threads)
    return labelled(
        f"largest Lyapunov exponent along {parameter}",
        model,
        found,
        coords={parameter: axis(model, parameter, points.coords[parameter])},
        variables={
            "exponent": Labelled(
                (parameter,), np.where(found.result == SUCCESS, growth, np.nan), "1", "largest Lyapunov exponent per cycle of excitation"
            ),
            "displacement": Labelled((parameter, "cycle"), found.u, "m", "displacement at the strobes"),
            "result": outcome((parameter,), found.result),
        },
        settings={"base_amplitude": base_amplitude, "parameter": parameter, "cycles": cycles} | fixed,
    )
