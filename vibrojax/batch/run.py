"""The entry point of batches: chunks of lanes on every core, cycle by cycle, until orbits close or the cycles are over."""

import dataclasses
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from vibrojax.batch.base import TABLES, AbstractEngine, Cycles, Lanes, LaneState
from vibrojax.batch.exact_flight import ExactFlight
from vibrojax.batch.kernel import BLOCK, MOST_LANES, in_one_kernel
from vibrojax.batch.points import Points, Responses, lanes_of, section_scales
from vibrojax.batch.stepping import Stepping
from vibrojax.compiling import LONG
from vibrojax.errors import InputError
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model


def repeats(sections: np.ndarray, scale: np.ndarray, tolerance: float, longest: int) -> np.ndarray:
    """After how many cycles each orbit comes back to where it was, all through the last such stretch.

    Arguments:
        sections: (u, u') at successive strobes, m and m/s, `(cycles, 2, lanes)`.
        scale: sizes to which the tolerance is relative (`section_scales`), `(2, lanes)`.
        tolerance: largest distance that counts as none.
        longest: longest period searched for, cycles; at most half of what is given.

    Returns:
        The shortest period of each lane in cycles; 0 where there is none.

    Example:
        >>> sections = np.array([1.0, 2.0, 1.0, 2.0])[:, None, None] * np.ones((1, 2, 1))
        >>> repeats(sections, np.ones((2, 1)), 1e-9, 8)
        array([2])
    """
    period = np.zeros(sections.shape[-1], dtype=int)
    for q in range(min(longest, len(sections) // 2), 0, -1):
        distance = np.abs(sections[-q:] - sections[-2 * q : -q]) / scale
        period = np.where(np.all(distance < tolerance, axis=(0, 1)), q, period)
    return period


_SIDE_BY_SIDE = 64
"""Lanes on a processor: enough to hide what a step costs apart from arithmetic, few enough that they wait little for the slowest."""
_SEGMENT = 16
"""Largest number of cycles between two checks whether orbits have closed."""
_LONGEST = 8
"""Cycles; longer orbits are integrated to the end."""
_SLACK = 1e3
"""Of the tolerance, when the period of an orbit that has closed is named: a transient that rings at half the excitation frequency falls
below the tolerance after two cycles before it does after one."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Span:
    """How long to integrate, and when to stop before.

    Attributes:
        transient: cycles that are left to die down, at least; rounded up where `closed` is looked for.
        recorded: cycles that are kept.
        closed: an orbit that comes back to within this part of the base amplitude is taken as periodic and not integrated further;
            None integrates all cycles.
    """

    transient: int = 300
    recorded: int = 16
    closed: float | None = 1e-9

    @property
    def call(self) -> tuple[int, int]:
        """Cycles that are integrated at a time, and how many of them are kept."""
        if self.closed is None:
            return self.transient + self.recorded, self.recorded
        parts = -(-self.recorded // _SEGMENT)
        while self.recorded % parts:
            parts += 1
        return self.recorded // parts, self.recorded // parts

    @property
    def calls(self) -> int:
        """How often that many."""
        return -(-(self.transient + self.recorded) // self.call[0])

    @property
    def total(self) -> int:
        """Cycles in all, where no orbit closes."""
        return self.calls * self.call[0]


def engine_for(lanes: Lanes) -> AbstractEngine:
    """The fast path where it fits, else Runge-Kutta steps."""
    fast = ExactFlight()
    return fast if fast.unfit(lanes) is None else Stepping()


def integrate(
    model: Model,
    points: Points,
    *,
    span: Span | None = None,
    engine: AbstractEngine | None = None,
    start: LaneState | None = None,
    chunk: int | None = None,
    threads: int | None = None,
) -> Responses:
    """Integrate a model at many operating points at once.

    Memory does not grow with the number of cycles. Results do not depend on `chunk` or `threads`, but for rounding.

    Arguments:
        model: the rig; effects and any suspension are allowed.
        points: where, see `grid`.
        span: how long; by default 300 cycles, the last 16 recorded, or until the orbit has closed.
        engine: the method; by default `ExactFlight` where it fits the model, else `Stepping`. The answer says which.
        start: state of every lane at t = 0, in place of u0 and v0, such as that of an earlier batch.
        chunk: lanes that are stepped side by side; by default 64. On a GPU all of them or 131,072, and always a multiple of 64; lanes
            that are missing are computed as copies.
        threads: chunks at a time; by default one a core, on a GPU one.

    Raises:
        InputError: points that do not suit the model, or an engine that does not; before anything is computed.

    Example:
        >>> from vibrojax.batch import grid
        >>> from vibrojax.contact import Newton
        >>> from vibrojax.suspension import Linear
        >>> model = Model(mass=1.0, suspension=Linear(0.02, 4.0), law=Newton(0.8))
        >>> integrate(model, grid({"frequency_hz": [4.1]}, base_amplitude=1e-3, gap=1e-3)).impacts.max().item()
        1
    """
    span = Span() if span is None else span
    if span.recorded < 1 or span.transient < 0:
        raise InputError(f"span of {span.transient} + {span.recorded} cycles: expected at least 0 and at least 1; correct it")
    lanes, initial = lanes_of(model, points)
    strobes = Strobes(lanes, engine=engine, chunk=chunk, threads=threads)
    begin = time.perf_counter()
    batch = Batch(strobes, initial if start is None else start, points.flat()["base_amplitude"], span)
    with strobes:
        for _ in range(span.calls):
            batch.advance(np.flatnonzero(batch.open))
    return batch.responses(points, time.perf_counter() - begin)


class Strobes:
    """Many lanes that are taken from strobe to strobe, any of them at a time: chunk by chunk, on every core.

    A context manager, which holds the threads.

    Arguments:
        lanes: the rigs.
        engine: as in `integrate`.
        chunk: the same.
        small: size of a chunk that is at hand for few lanes; by default none.
        threads: the same.

    Raises:
        InputError: an engine that does not suit the rigs, or a chunk without lanes.
    """

    def __init__(
        self,
        lanes: Lanes,
        *,
        engine: AbstractEngine | None = None,
        chunk: int | None = None,
        small: int | None = None,
        threads: int | None = None,
    ):
        on_gpu = jax.default_backend() == "gpu"
        self.engine = engine_for(lanes) if engine is None else engine
        if (reason := self.engine.unfit(lanes)) is not None:
            raise InputError(f"the engine {self.engine.name} does not integrate {reason}: leave the engine out, or choose stepping")
        leaves, self.form = jax.tree.flatten(lanes)
        self.rigs = np.stack([np.asarray(leaf) for leaf in leaves])
        if chunk is None:
            chunk = min(MOST_LANES, self.rigs.shape[1]) if on_gpu else _SIDE_BY_SIDE
        if chunk < 1:
            raise InputError(f"chunk is {chunk}: expected at least 1 lane; correct it")
        block = BLOCK if on_gpu else 1
        self.chunk, small = (-(-lanes // block) * block for lanes in (chunk, small or chunk))
        self.small = min(small, self.chunk)
        self._pool = ThreadPoolExecutor(threads or (1 if on_gpu else len(os.sched_getaffinity(0))))

    def __enter__(self) -> "Strobes":
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()

    def advance(
        self, index: np.ndarray, state: np.ndarray, cycles: int | np.ndarray, recorded: int
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Take lanes on by so many cycles.

        Arguments:
            index: which lanes; one may occur several times.
            state: of each, as `packed` lays it out, `(rows, lanes)`.
            cycles: how many; or of each lane, at most `recorded`.
            recorded: how many of them are handed back, the last ones; rows before a lane's own mean nothing.

        Returns:
            The states, and what `Cycles` holds by name: tables `(recorded, lanes)`, `u_max` and `result` `(lanes,)`.
        """
        order, same = np.arange(index.size), cycles if isinstance(cycles, int) else None
        assert same is not None or np.max(cycles, initial=0) <= recorded, "cycles of each lane: at most as many as are handed back"
        if same is None:
            order, state = np.argsort(cycles, kind="stable"), np.concatenate([state, np.asarray(cycles)[None]])
        pieces = [order[i : i + self.chunk] for i in range(0, index.size, self.chunk)]
        found = list(self._pool.map(lambda piece: self._piece(index[piece], state[:, piece], same, recorded), pieces))
        sizes, back = [piece.size for piece in pieces], np.argsort(order)
        states = np.concatenate([after[:, :size] for size, (after, _) in zip(sizes, found, strict=True)], axis=1)[:, back]

        def joined(name: str) -> np.ndarray:
            parts = [np.asarray(getattr(what, name))[..., :size] for size, (_, what) in zip(sizes, found, strict=True)]
            return np.concatenate(parts, axis=-1)[..., back]

        return states, {name: joined(name) for name in (*TABLES, "u_max", "result")}

    def _piece(self, index: np.ndarray, state: np.ndarray, cycles: int | None, recorded: int) -> tuple[np.ndarray, Cycles]:
        """One chunk, or a small one where that is enough; lanes that are missing are copies of its last one."""
        chunk = self.small if index.size <= self.small else self.chunk
        full = np.minimum(np.arange(chunk), index.size - 1)
        rows = self.rigs.shape[0], state.shape[0]
        advance = _compiled(self.engine, self.form, rows, chunk, cycles, recorded)
        after, what = advance(self.rigs[:, index[full]], state[:, full])
        return np.asarray(after), what


class Batch:
    """Lanes while they are integrated, in NumPy.

    Arguments:
        strobes: the rigs.
        state: of every lane at t = 0.
        amplitude: A0 of every lane, m.
        span: how long; its parts of `Span.call` cycles are what is taken at a time.
    """

    def __init__(self, strobes: Strobes, state: LaneState, amplitude: np.ndarray, span: Span):
        self.strobes, self.span, self.state = strobes, span, packed(state)
        frequency = np.asarray(jax.tree.unflatten(strobes.form, list(strobes.rigs)).frequency_hz)
        count, kept = frequency.size, span.recorded
        self.open = np.ones(count, dtype=bool)
        self.result = np.full(count, SUCCESS)
        self.closed = np.zeros(count, dtype=int)
        self.closing = np.zeros(count, dtype=bool)
        self.done = np.zeros(count, dtype=int)
        self.u_max = np.full(count, np.nan)
        self.kept: dict[str, np.ndarray] = {name: np.zeros((kept, count)) for name in TABLES}
        self.scale = section_scales(amplitude, frequency)

    def advance(self, index: np.ndarray) -> None:
        """Take some lanes on by one segment."""
        if index.size:
            self.state[:, index], cycles = self.strobes.advance(index, self.state[:, index], *self.span.call)
            self._note(index, cycles)

    def _note(self, index: np.ndarray, cycles: dict[str, np.ndarray]) -> None:
        (cycles_at_once, segment), kept = self.span.call, self.span.recorded
        self.done[index] += cycles_at_once
        self.u_max[index] = cycles["u_max"]
        self.result[index] = cycles["result"]
        for name, values in self.kept.items():
            recent = np.concatenate([values[segment:, index], cycles[name]], axis=0) if segment < kept else cycles[name]
            if index.size == self.open.size:
                self.kept[name] = recent
            else:
                values[:, index] = recent
        self.open[index[cycles["result"] != SUCCESS]] = False
        if self.span.closed is not None:
            self._close(index[cycles["result"] == SUCCESS])

    def _close(self, index: np.ndarray) -> None:
        """Orbits that repeat, and did so a segment before, so that nothing kept is older, are continued by repetition and left there."""
        known = min(int(self.done[index].min(initial=self.span.recorded)), self.span.recorded)
        if known < 2:
            return
        sections = np.stack([self.kept[name][-known:, index] for name in ("u", "v")], axis=1)
        scale, tolerance = self.scale[:, index], self.span.closed or 0.0
        repeat = repeats(sections, scale, tolerance, _LONGEST) > 0
        over, self.closing[index] = repeat & self.closing[index], repeat
        period = repeats(sections, scale, _SLACK * tolerance, _LONGEST)[over]
        over = index[over]
        for values in self.kept.values():
            # cycles, counted from the first that is left out
            wanted = np.arange(-len(values), 0)[:, None] + self.span.total - self.done[over]
            values[:, over] = np.take_along_axis(values[:, over], len(values) - period + np.mod(wanted, period), axis=0)
        self.closed[over], self.open[over] = period, False

    def responses(self, points: Points, seconds: float) -> Responses:
        """Everything in the shape of the axes."""

        def shaped(values: np.ndarray) -> np.ndarray:
            return np.moveaxis(values, 0, -1).reshape(*points.shape, -1) if values.ndim == 2 else values.reshape(points.shape)

        kept = {name: shaped(values) for name, values in self.kept.items()}
        kept["impacts"] = kept["impacts"].astype(int)
        return Responses(
            coords=dict(points.coords),
            **kept,
            u_max=shaped(self.u_max),
            closed=shaped(self.closed),
            cycles=shaped(self.done),
            result=shaped(self.result),
            state=unpacked(jnp.asarray(self.state)),
            engine=self.strobes.engine.name,
            seconds=seconds,
        )


@lru_cache(maxsize=64)
def _compiled(
    engine: AbstractEngine, form: Any, rows: tuple[int, int], lanes: int, cycles: int | None, recorded: int
) -> Callable[[Any, Any], tuple[jax.Array, Cycles]]:
    """The program of one chunk: few arguments, since each costs as much to hand over as several steps.

    Without `cycles`, these are the last row of the state.
    """

    def as_recorded(what: Cycles) -> Cycles:
        return what._replace(**{name: getattr(what, name)[:recorded] for name in TABLES})

    @partial(jax.jit, compiler_options=LONG)  # of arrays alone: `equinox.filter_jit` costs as much a call as thirty steps
    def by_xla(rigs: jax.Array, state: jax.Array):
        state, count = (state[:-1], jnp.round(state[-1]).astype(int)) if cycles is None else (state, cycles)
        after, what = engine.advance(jax.tree.unflatten(form, list(rigs)), unpacked(state), count, recorded)
        return _packed_array(after), as_recorded(what)

    @jax.jit
    def as_kernel(rigs: jax.Array, state: jax.Array):
        after, what = in_one_kernel(engine, form, cycles, recorded, rigs, state)
        return after, as_recorded(what)

    if not engine.in_kernel or jax.default_backend() != "gpu":
        return by_xla
    try:
        as_kernel.lower(*(jax.ShapeDtypeStruct((count, lanes), jnp.result_type(float)) for count in rows))
    except NotImplementedError:  # an operation of the contact law that Pallas does not lower
        return by_xla
    return as_kernel


def _packed_array(state: LaneState) -> jax.Array:
    rows = [state.u, state.v, state.in_contact, state.approach_speed, state.since_touch, state.cycle]
    return jnp.concatenate([jnp.stack([row.astype(state.u.dtype) for row in rows]), state.own.T])


def packed(state: LaneState) -> np.ndarray:
    """States of all lanes as one array, `(rows, lanes)`: as it is stored."""
    return np.array(_packed_array(state))


def unpacked(rows: jax.Array) -> LaneState:
    """The states that `packed` made an array of."""
    u, v, in_contact, approach_speed, since_touch, cycle = rows[:6]
    return LaneState(u, v, in_contact > 0.5, approach_speed, since_touch, jnp.round(cycle).astype(int), rows[6:].T)
