"""Peterka map: kinds of motion over frequency ratio and clearance, from the stable orbits that exist at each cell."""

import time
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float, Int

from vibrojax.batch import Batch, Points, Responses, Span, Strobes, integrate
from vibrojax.batch.points import lanes_of, section_scales
from vibrojax.errors import InputError
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.base import (
    APERIODIC,
    CHAOS,
    FAILED,
    LONGEST,
    NO_IMPACT,
    PERIODIC,
    Kind,
    Labelled,
    Values,
    classify,
    codes,
    forces,
    labelled,
    motions,
    natural_frequency,
)
from vibrojax.studies.coexistence import KICKS, evenly, kicked
from vibrojax.studies.lyapunov import exponents
from vibrojax.studies.orbit_plane import SLOTS, OrbitPlane

_SIDE_BY_SIDE, _FEW = 64, 16
"""Lanes on a processor while orbits are looked for, and where there are few."""
_ASKED = 24
"""Cells along each axis at which all starts are tried, at most."""
_SETTLED = 80
"""Cycles after which a motion from some start lies near enough to its orbit for Newton's method."""
_STRIDES = (8, 4, 2, 1)
"""Cells without an orbit are iterated from rest in this order, each time followed by what their orbits lead to."""
_CAUGHT = 0.05
"""Of A0, and of A0 Omega: a motion that comes as near to a stable orbit, nearer than a segment before, and strikes as often, ends on it."""
_COARSE = 4
"""Cells between those along both axes that are the first to be iterated from rest where an orbit is known; fewer on a small map."""
_QUARTER, _CLEARLY = 4, (-0.05, 0.1)
"""Part of the cycles over which an exponent is averaged at first, and beyond which values per cycle it is left at that: over 50 cycles,
0.7 % of those below and 97 % of those above are found on the same side of the threshold of chaos over 200 (rig of `benchmarks.maps`)."""
ITERATED, APPROACHED, CONTINUED = 0, 1, 2
_SHOWN = (
    "how the motion is known: 0 iterated from rest, 1 orbit that was approached from rest, 2 the only orbit, approached from rest around"
)


class _Map(NamedTuple):
    """One entry a cell."""

    kind: Int[np.ndarray, " cells"]
    impacts: Int[np.ndarray, " cells"]
    period: Int[np.ndarray, " cells"]
    force: Float[np.ndarray, " cells"]
    growth: Float[np.ndarray, " cells"]
    shown: Int[np.ndarray, " cells"]
    other_code: Int[np.ndarray, "cells other"]
    other_force: Float[np.ndarray, "cells other"]
    asked: Bool[np.ndarray, " cells"]


def peterka(
    model: Model,
    *,
    ratio: Values,
    clearance: Values,
    base_amplitude: float,
    span: Span | None = None,
    lyapunov_cycles: int = 200,
    follow: bool = True,
    **options: Any,
) -> xr.Dataset:
    """Map of z = p/q (p impacts in q cycles of excitation) that is reached from rest, and of the stable orbits beside it.

    Stable orbits of up to 8 cycles are found from a few starts at a few cells and continued from cell to cell by Newton's method on the
    map from strobe to strobe (`orbit_plane`). Which of them rest leads to is iterated until one is approached; where one orbit alone is
    known, at some cells only, and wherever these do not agree. Cells at which no orbit is known are iterated; there the largest Lyapunov
    exponent separates chaos (above zero) from motion with a longer period, and from motion that has not settled yet. A model with effects
    is iterated at every cell.

    Arguments:
        model: the rig; its suspension has a natural frequency omega.
        ratio: Omega / omega.
        clearance: gap / A0.
        base_amplitude: A0 > 0, m.
        span: how long a motion is iterated at most; by default 300 cycles or until the orbit has closed.
        lyapunov_cycles: over which the exponent of an aperiodic motion is averaged; 0 leaves it out.
        follow: whether orbits are continued; without, every cell is iterated, as a check.
        options: of `vibrojax.batch.integrate`: engine, chunk, threads.

    Returns:
        `kind`, `impacts` (p), `period` (q), `impact_force` (N), `force_over_weight` (1), `lyapunov` (1 per cycle; NaN where not asked),
        `shown` (how the motion is known) on the axes (`clearance`, `ratio`); `other_code` (1000 p + q, 0 for rest, -1 for none) and
        `other_force` (N) of the stable orbits beside it on these and `other`; `asked`, 1 where all starts were tried.

    Source: F. Peterka, Bifurcations and transition phenomena in an impact oscillator, Chaos, Solitons & Fractals 7 (1996) 1635-1647, for
    maps of impact motions and the quantity z = p/n; how the regions are filled, and the reading of the exponent, are ours.
    """
    if not base_amplitude > 0:
        raise InputError(f"base_amplitude is {base_amplitude:g}: expected a number above 0, since clearances are relative to it")
    f_n = natural_frequency(model, "a Peterka map")
    ratio, clearance = np.atleast_1d(np.asarray(ratio, dtype=float)), np.atleast_1d(np.asarray(clearance, dtype=float))
    settings = {"frequency_hz": ratio[None, :] * f_n, "gap": clearance[:, None] * base_amplitude, "base_amplitude": base_amplitude}
    points = Points(coords={"clearance": clearance, "ratio": ratio}, values=settings)
    made = _followed if follow and not model.rig.effects else _iterated
    found, cells = made(model, points, span or Span(), lyapunov_cycles, options)
    dims = ("clearance", "ratio")
    parts = {name: part.reshape(*points.shape, *part.shape[1:]) for name, part in cells._asdict().items()}
    kind = Kind(parts["kind"], parts["impacts"], parts["period"])
    return labelled(
        "Peterka map",
        model,
        found,
        coords={
            "clearance": Labelled(("clearance",), clearance, "1", "gap over base amplitude"),
            "ratio": Labelled(("ratio",), ratio, "1", "excitation frequency over natural frequency"),
        },
        variables={
            **motions(dims, kind, np.where(kind.kind == FAILED, found.result, SUCCESS)),
            **forces(dims, parts["force"], float(np.asarray(model.mass))),
            "lyapunov": Labelled(dims, parts["growth"], "1", "largest Lyapunov exponent per cycle of excitation"),
            "shown": Labelled(dims, parts["shown"], "1", _SHOWN),
            "other_code": Labelled((*dims, "other"), parts["other_code"], "1", "another motion: 1000 p + q, 0 rest, -1 none"),
            "other_force": Labelled((*dims, "other"), parts["other_force"], "N", "its largest impact force"),
            "asked": Labelled(dims, parts["asked"].astype(int), "1", "whether all starts were tried here"),
        },
        settings={"base_amplitude": base_amplitude},
    )


def _iterated(model: Model, points: Points, span: Span, lyapunov_cycles: int, options: dict[str, Any]) -> tuple[Responses, _Map]:
    """Every cell from rest."""
    found = integrate(model, points, span=span, **options)
    kind, impacts, period = (part.ravel() for part in classify(found, points.values["base_amplitude"], points.values["frequency_hz"]))
    growth = _growth(model, points, found.state, kind == APERIODIC, lyapunov_cycles, options)
    nothing = np.zeros(points.lanes, int)
    none, unknown = np.full((points.lanes, SLOTS), -1), np.full((points.lanes, SLOTS), np.nan)
    force = found.peak_force.max(axis=-1).ravel()
    return found, _Map(kind, impacts, period, force, growth, nothing + ITERATED, none, unknown, nothing.astype(bool))


def _growth(model: Model, points: Points, state: Any, chosen: np.ndarray, cycles: int, options: dict[str, Any]) -> np.ndarray:
    """Largest Lyapunov exponent of some cells, NaN of the others: over a quarter of the cycles where its sign is then clear."""
    growth = np.full(points.lanes, np.nan)
    for part in (max(cycles // _QUARTER, 1), cycles):
        unsure = chosen & ~((growth < _CLEARLY[0]) | (growth > _CLEARLY[1]))
        if cycles > 0 and unsure.any():
            growth[unsure] = exponents(model, points, state, unsure, cycles=part, threads=options.get("threads"))[:, 0]
    return growth


def _followed(model: Model, points: Points, span: Span, lyapunov_cycles: int, options: dict[str, Any]) -> tuple[Responses, _Map]:
    """Orbits first, then which of them rest leads to, then what is left."""
    begin, values = time.perf_counter(), points.flat()
    lanes, rest = lanes_of(model, points)
    scale = section_scales(values["base_amplitude"], values["frequency_hz"])
    chosen = {name: options[name] for name in ("engine", "threads") if name in options}
    with Strobes(lanes, chunk=_SIDE_BY_SIDE, small=_FEW, **chosen) as wide, Strobes(lanes, chunk=options.get("chunk"), **chosen) as strobes:
        plane = OrbitPlane(wide, (points.shape[0], points.shape[1]), scale)
        batch = Batch(strobes, rest, values["base_amplitude"], span)
        asked = _ask(model, plane, strobes, points, span)
        _search(plane, batch)
        into = _reached(plane, batch)
        wild = np.flatnonzero((into < 0) & (batch.open | (batch.closed == 0)) & (batch.result == 0))
        mask = np.zeros(points.lanes, bool)
        mask[wild] = True
        growth = _growth(model, points, batch.responses(points, 0.0).state, mask, lyapunov_cycles, options)
        late = np.flatnonzero(mask & ~(growth > CHAOS))
        _onward(plane, batch, late, into)
    found = batch.responses(points, time.perf_counter() - begin)
    return found, _summed(plane, found, points, into, growth, asked)


def _ask(model: Model, plane: OrbitPlane, strobes: Strobes, points: Points, span: Span) -> np.ndarray:
    """Find orbits by all starts at some cells, and continue them; which cells."""
    asked = evenly(plane.shape, (_ASKED, _ASKED))
    starts = np.repeat(np.flatnonzero(asked), len(KICKS) + 2)
    u, v = kicked(model, points.chosen(starts).values, KICKS)
    nothing = np.zeros(starts.size)
    state = np.stack([u, v, nothing, np.abs(v), nothing, nothing])
    segment, recorded = span.call[0], span.call[1]
    what: dict[str, np.ndarray] = {}
    for _ in range(-(-_SETTLED // segment)):
        state, what = strobes.advance(starts, state, segment, recorded)
    whole = np.flatnonzero(what["result"] == 0)
    plane.spread(plane.near_returns(starts[whole], what["u"][:, whole], what["v"][:, whole]))
    return asked


def _search(plane: OrbitPlane, batch: Batch) -> None:
    """Iterate cells without an orbit from rest, first a few of them, until every cell has an orbit or has been iterated for a while."""
    row, column = np.divmod(np.arange(plane.count.size), plane.shape[1])
    for stride in _STRIDES:
        cells = np.flatnonzero((plane.count == 0) & (batch.done == 0) & (row % stride == 0) & (column % stride == 0))
        while (on := cells[batch.open[cells] & (batch.done[cells] < min(_SETTLED, batch.span.total))]).size:
            batch.advance(on)
        _continue_from(plane, batch, cells)


def _continue_from(plane: OrbitPlane, batch: Batch, cells: np.ndarray) -> None:
    """Orbits near where the motions from rest are."""
    cells = cells[(batch.result[cells] == 0) & (batch.done[cells] >= batch.span.recorded)]
    plane.spread(plane.near_returns(cells, batch.kept["u"][:, cells], batch.kept["v"][:, cells]))


def _reached(plane: OrbitPlane, batch: Batch) -> np.ndarray:
    """Slot of the orbit that rest leads to at each cell; -1 where none was approached.

    First at the cells of a coarse lattice, then of finer ones. A cell takes the motion of the lattice before around it where that is one
    and the same, and has its orbit: that of the four nearest cells where the orbit is its only one, else that of the sixteen nearest.
    Elsewhere it is iterated.
    """
    into = np.full(plane.count.size, -1)
    coarse = min(_COARSE, max(1, min(plane.shape) // 75))
    lattice: list[np.ndarray] = []
    for every in (stride for stride in _STRIDES if stride <= coarse):
        finer = [np.unique(np.append(np.arange(0, size, every), size - 1)) for size in plane.shape]
        here = np.zeros(plane.shape, bool)
        here[np.ix_(*finer)] = True
        left = np.flatnonzero(here.ravel() & (plane.count > 0) & (into < 0) & (batch.done < batch.span.total))
        slot = np.full(left.size, -1)
        if lattice:
            slot = np.where(plane.count[left] == 1, *(_as_around(plane, into, left, lattice, reach) for reach in (1, 2)))
        into[left[slot >= 0]] = slot[slot >= 0]
        _onward(plane, batch, left[slot < 0], into)
        lattice = finer
    return into


def _as_around(plane: OrbitPlane, into: np.ndarray, cells: np.ndarray, lattice: list[np.ndarray], reach: int) -> np.ndarray:
    """Slot of the motion that rest leads to at all cells of the lattice within so many of its lines on every side; -1 where they differ."""
    code = np.where(into >= 0, plane.code[np.maximum(into, 0), np.arange(into.size)], -1)
    low = [np.searchsorted(line, part, side="right") - 1 for line, part in zip(lattice, np.divmod(cells, plane.shape[1]), strict=True)]
    around = []
    for down in range(1 - reach, reach + 1):
        for right in range(1 - reach, reach + 1):
            row, column = (line[np.clip(part + way, 0, len(line) - 1)] for line, part, way in zip(lattice, low, (down, right), strict=True))
            around.append(code[row * plane.shape[1] + column])
    agreed = (np.array(around) == around[0]).all(axis=0) & (around[0] >= 0)
    own = plane.code[:, cells] == around[0]
    return np.where(agreed & (own.sum(axis=0) == 1), own.argmax(axis=0), -1)


def _onward(plane: OrbitPlane, batch: Batch, cells: np.ndarray, into: np.ndarray) -> None:
    """Iterate cells from rest until they approach an orbit, at most all cycles; look for new orbits where none is approached."""
    before = np.full(plane.count.size, np.inf)
    looked = 0
    while True:
        cells = cells[(into[cells] < 0) & batch.open[cells] & (batch.done[cells] < batch.span.total)]
        if cells.size == 0:
            return
        batch.advance(cells)
        distance, slot = _nearest(plane, batch, cells)
        caught = (distance < before[cells]) & _as_it_strikes(plane, batch, cells, slot, distance)
        into[cells[caught]] = slot[caught]
        before[cells] = distance
        looked += batch.span.call[0]
        if looked >= _SETTLED:
            looked = 0
            _continue_from(plane, batch, cells[~caught])


def _as_it_strikes(plane: OrbitPlane, batch: Batch, cells: np.ndarray, slot: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Whether motions strike as often as the orbits near to them; without impacts all along, a motion can only die down to rest."""
    hits, rows = batch.kept["impacts"][:, cells], batch.span.recorded
    code, period = plane.code[slot, cells], plane.period[slot, cells]
    last = np.where(np.arange(rows)[::-1, None] < period, hits, 0).sum(axis=0)
    return np.where(code == 0, hits.sum(axis=0) == 0, (distance < _CAUGHT) & (last == code // 1000))


def _nearest(plane: OrbitPlane, batch: Batch, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least distance of the last strobes to each cell's orbits, over A0 and A0 Omega, and the slot of the nearest."""
    rows = min(LONGEST, batch.span.recorded)
    scale = plane.scale[:, cells]
    u, v = (batch.kept[name][-rows:, cells] / part for name, part in zip(("u", "v"), scale, strict=True))
    period = plane.period[:, cells]
    distance = np.full((SLOTS, cells.size), np.inf)
    for slot in range(int(plane.count[cells].max(initial=0))):
        x = plane.state[slot][:, cells] / scale
        each = np.maximum(np.abs(u - x[0]), np.abs(v - x[1]))
        each[np.arange(rows)[::-1, None] >= period[slot][None, :]] = np.inf
        distance[slot] = np.where(plane.code[slot, cells] >= 0, each.min(axis=0), np.inf)
    return distance.min(axis=0), distance.argmin(axis=0)


def _summed(plane: OrbitPlane, found: Responses, points: Points, into: np.ndarray, growth: np.ndarray, asked: np.ndarray) -> _Map:
    """The motion that rest leads to at every cell, and the orbits beside it."""
    everyone = np.arange(into.size)
    seen = classify(found, points.values["base_amplitude"], points.values["frequency_hz"])
    kind, impacts, period = (part.ravel().copy() for part in seen)
    force, cycles = found.peak_force.max(axis=-1).ravel(), found.cycles.ravel()
    kind[(growth > CHAOS) & (kind != FAILED)] = APERIODIC
    known = into >= 0
    slot = np.maximum(into, 0)
    code = np.where(known, plane.code[slot, everyone], -1)
    kind = np.where(known, np.where(code > 0, PERIODIC, NO_IMPACT), kind)
    impacts, period = np.where(known, code // 1000, impacts), np.where(known, plane.period[slot, everyone], period)
    force = np.where(known, plane.force[slot, everyone], force)
    growth = np.where(kind == APERIODIC, growth, np.nan)
    impacts, period = (np.where(kind == APERIODIC, 0, part) for part in (impacts, period))
    own = codes(kind, impacts, period)
    own_slot = np.where(known, into, -1)
    others = (plane.code >= 0) & (np.arange(SLOTS)[:, None] != own_slot) & (known | (plane.code != own))
    order = np.argsort(~others, axis=0, kind="stable")
    other_code = np.where(np.take_along_axis(others, order, 0), np.take_along_axis(plane.code, order, 0), -1)
    other_force = np.where(other_code >= 0, np.take_along_axis(plane.force, order, 0), np.nan)
    shown = np.where(known, np.where(cycles > 0, APPROACHED, CONTINUED), ITERATED)
    return _Map(kind, impacts, period, force, growth, shown, other_code.T, other_force.T, asked)
