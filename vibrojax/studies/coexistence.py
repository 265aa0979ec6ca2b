"""Which motions exist beside the one that a study shows: a few kicked starts at some of its points, and each motion followed from there.

Motions differ by their z = p/q; motions without impact are one, called rest. It counts where the orbit has closed to
a millionth of A0 or no impact is left; what is aperiodic does not in a study of many points, since a long transient cannot be distinguished
from it. A motion that is found at one value is started at its neighbours along the study's axis, and so on, until it is lost: a sweep up
and down from each of them. At a single operating point there is time for more starts and cycles, and whatever strikes after 1500 counts.
"""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr

from vibrojax.batch import LaneState, Points, Span, grid, integrate, packed, unpacked
from vibrojax.batch.points import STILL, section_scales
from vibrojax.batch.run import repeats
from vibrojax.model import Model
from vibrojax.studies.base import (
    ALIKE,
    APERIODIC,
    LONGEST,
    NO_IMPACT,
    PERIODIC,
    Labelled,
    assigned,
    classify,
    code,
    codes,
    natural_frequency,
    setting,
)

KICKS = ((0.1, 2.5), (0.5, -1.0), (1.0, 1.0), (2.0, -4.0), (2.0, 4.0), (3.5, -2.0), (5.0, -3.0), (5.0, 1.5))
"""Initial states: distance from the stop over the larger of gap and A0, and velocity over that and Omega; spread over where the thesis's
rigs have both motions. Two more starts are rest and the steady motion of the suspension without a stop."""
_PLANE = tuple((back, fast) for back in np.linspace(0.1, 5.0, 4) for fast in np.linspace(-4.0, 4.0, 5))
"""The kicks at a single operating point."""
_SPAN = Span(transient=224, closed=1e-6)
"""Of many points: what repeats to a millionth of A0 exists."""
_LONG, _WILD, _CHUNK = Span(transient=1200, closed=1e-6), 6, 24
"""At a single operating point: how long what has not closed goes on, in all for the 1500 cycles of `vibrojax.presets.facts`; how many of
those; and lanes side by side."""
APERIODIC_CODE = 1
"""Of impacts without a period: no other motion has it."""
ASKED = 30
"""Values along the axis of a study at which all starts are tried, at most."""
_CELLS = 12
"""The same along each axis of a map."""


FROM_CELL_TO_CELL = "from cell to cell"
"""How the orbits of a map are followed."""


class Motion(NamedTuple):
    """A motion at one point."""

    force: float
    """Largest impact force, N."""
    speed: float
    """Largest approach speed, m/s."""
    strobes: np.ndarray
    """u, m, and u', m/s, at the last strobes, `(2, LONGEST)`."""
    state: np.ndarray
    """As `vibrojax.batch.packed` has it, one lane."""


def name(of: int) -> str:
    """Words for a code.

    Example:
        >>> name(code(1, 2)), name(0)
        ('z = 1/2', 'rest')
    """
    return {0: "rest", APERIODIC_CODE: "aperiodic impacts"}.get(of, f"z = {of // 1000}/{of % 1000}")


def motions(model: Model, points: Points, asked: np.ndarray, along: int | None) -> list[dict[int, Motion]]:
    """The motions that exist at each point, by their codes.

    Arguments:
        model: the rig.
        points: of the study.
        asked: lanes at which all starts are tried.
        along: axis of the points along which motions are followed; None for nowhere.
    """
    lanes = np.arange(points.lanes).reshape(points.shape)
    found: list[dict[int, Motion]] = [{} for _ in range(points.lanes)]
    kicks = _PLANE if points.lanes == 1 else KICKS
    starts = np.repeat(asked, len(kicks) + 2)
    at = points.chosen(starts)
    u0, v0 = kicked(model, at.values, kicks)
    front = _settled(model, dataclasses.replace(at, values=dict(at.values) | {"u0": u0, "v0": v0}), starts, None, found, _SPAN)
    tried = {(lane, of) for lane, of in front}
    while front and along is not None:
        onward = []
        for way in (1, -1):
            beyond = np.full(points.lanes, -1)
            ahead, here = (np.moveaxis(lanes, along, 0)[slice(*ends)].ravel() for ends in (((1, None), (None, -1))[::way]))
            beyond[here] = ahead
            onward += [(int(beyond[lane]), of, found[lane][of].state) for lane, of in front if beyond[lane] >= 0]
        onward = [one for one in onward if one[1] not in found[one[0]] and (one[0], one[1]) not in tried]
        tried |= {(lane, of) for lane, of, _ in onward}
        if not onward:
            break
        index = np.array([lane for lane, _, _ in onward])
        state = unpacked(jnp.asarray(np.stack([state for _, _, state in onward], axis=1)))
        front = _settled(model, points.chosen(index), index, state, found, _SPAN)
    return found


def kicked(model: Model, values: Mapping[str, np.ndarray], kicks: Sequence[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """u0 and v0 of rest, of the steady motion without a stop, and of the kicks, in turn."""
    gap, amplitude, omega = values["gap"], values["base_amplitude"], 2.0 * np.pi * values["frequency_hz"]
    size = np.maximum(np.abs(gap), amplitude)
    size = np.where(size > 0, size, STILL)
    turn = np.arange(len(gap)) % (len(kicks) + 2)
    back, fast = np.array([(0.0, 0.0), (0.0, 0.0), *kicks])[turn].T
    u0, v0 = gap - back * size, fast * size * omega
    u0[turn == 0] = 0.0
    known = {"f_n": np.nan, "zeta": np.nan} | {key: float(np.asarray(value)) for key, value in model.values().items()}
    omega_n = 2.0 * np.pi * values.get("f_n", np.full(len(gap), known["f_n"]))
    steady = amplitude * omega**2 / (omega_n**2 - omega**2 + 2j * values.get("zeta", known["zeta"]) * omega_n * omega)
    free = (turn == 1) & np.isfinite(steady)  # of A0 sin(Omega t): u = Im(steady exp(i Omega t))
    u0, v0 = np.where(free, steady.imag, u0), np.where(free, omega * steady.real, v0)
    return np.minimum(u0, gap), v0


def _settled(
    model: Model, at: Points, index: np.ndarray, start: LaneState | None, found: list[dict[int, Motion]], span: Span
) -> list[tuple[int, int]]:
    """Integrate from each start, note what is new at its lane (`index`), and return that."""
    alone = len(found) == 1
    there = integrate(model, at, start=start, span=span, chunk=_CHUNK if alone else None)
    kind = classify(there, at.values["base_amplitude"], at.values["frequency_hz"])
    wild = np.flatnonzero((kind.kind == APERIODIC) | ((kind.kind == PERIODIC) & (there.closed == 0)))[:_WILD]
    if alone and wild.size and span is not _LONG:
        _settled(model, at.chosen(wild), index[wild], unpacked(jnp.asarray(packed(there.state)[:, wild])), found, _LONG)
    state, new = packed(there.state), []
    state[5] = 0.0  # cycles are counted anew
    strikes, closed = kind.kind == PERIODIC, there.closed > 0
    counts = (kind.kind == NO_IMPACT) | (strikes & closed) | ((span is _LONG) & (strikes | (kind.kind == APERIODIC)))
    found_codes = codes(*kind, other=APERIODIC_CODE)
    for row in np.flatnonzero(counts):
        lane, of = int(index[row]), int(found_codes[row])
        if of not in found[lane]:
            force, speed = float(there.peak_force[row].max()), float(there.impact_speed[row].max())
            found[lane][of] = Motion(force, speed, np.stack([there.u[row, -LONGEST:], there.v[row, -LONGEST:]]), state[:, row])
            new.append((lane, of))
    return new


def with_coexistence(model: Model, data: xr.Dataset) -> xr.Dataset:
    """The study with the motions beside its own.

    Arguments:
        model: the rig.
        data: a response, a bifurcation diagram, a section, or a Peterka map whose orbits were not continued.

    Returns:
        `other_code` (1000 p + q, 0 for rest, -1 for none), `other_force` (N), `other_speed` (m/s), and at eight strobes
        `other_displacement` (m) and `other_velocity` (m/s) on the study's axes and `other`; `asked` (1 where all starts were tried). The
        attribute `coexistence` holds how many starts and points that is.
    """
    points, own = _points(model, data), own_motions(data)
    along = None if "clearance" in points.coords or points.lanes == 1 else len(points.shape) - 1
    most = [ASKED if axis == along else _CELLS if along is None else size for axis, size in enumerate(points.shape)]
    chosen = evenly(points.shape, most)
    found = motions(model, points, np.flatnonzero(chosen), along)
    others = [{of: one for of, one in here.items() if of not in mine} for here, mine in zip(found, own, strict=True)]
    most = max(1, *(len(one) for one in others))
    dims = tuple(points.coords) if points.lanes > 1 or "strobe" not in data.dims else ()
    shape = points.shape if dims else ()
    of, force, speed = np.full((points.lanes, most), -1), *np.full((2, points.lanes, most), np.nan)
    strobes = np.full((2, points.lanes, most, LONGEST), np.nan)
    for lane, here in enumerate(others):
        for place, (number, one) in enumerate(sorted(here.items())):
            of[lane, place], force[lane, place], speed[lane, place] = number, one.force, one.speed
            strobes[:, lane, place] = one.strobes
    dims_of = (*dims, "other"), (*dims, "other", "other_strobe")
    parts = {
        "other_code": Labelled(dims_of[0], of, "1", "another motion: 1000 p + q, 0 rest, -1 none"),
        "other_force": Labelled(dims_of[0], force, "N", "its largest impact force"),
        "other_speed": Labelled(dims_of[0], speed, "m/s", "its largest approach speed"),
        "other_displacement": Labelled(dims_of[1], strobes[0], "m", "its section points"),
        "other_velocity": Labelled(dims_of[1], strobes[1], "m/s", "its velocity there"),
        "asked": Labelled(dims, chosen.astype(int), "1", "whether all starts were tried here"),
    }
    said = {
        "starts": len(_PLANE if points.lanes == 1 else KICKS) + 2,
        "asked": int(chosen.sum()),
        "points": points.lanes,
        "followed": along is not None,
    }
    shaped = {key: part._replace(values=part.values.reshape((*shape, *part.values.shape[1:]))) for key, part in parts.items()}
    return assigned(data, shaped).assign_attrs(coexistence=json.dumps(said))


def of_map(model: Model, data: xr.Dataset) -> xr.Dataset:
    """A Peterka map with the attribute `coexistence`; one that was iterated throughout with the motions beside its own at some cells.

    Arguments:
        model: the rig.
        data: as `peterka` returns it.
    """
    asked = int(data["asked"].sum())
    if asked == 0:
        return with_coexistence(model, data)
    said = {"starts": len(KICKS) + 2, "asked": asked, "points": data["kind"].size, "followed": FROM_CELL_TO_CELL}
    return data.assign_attrs(coexistence=json.dumps(said))


def several_in_map(data: xr.Dataset) -> np.ndarray:
    """At which cells of a map several periodic motions are known, rest among them, `(clearance, ratio)`."""
    return (codes_of_map(data) >= 0).sum(axis=-1) > 1


def is_continued(data: xr.Dataset) -> bool:
    """Whether every cell of a map knows the orbits beside its own."""
    return json.loads(data.attrs["coexistence"])["followed"] == FROM_CELL_TO_CELL


def codes_of_map(data: xr.Dataset) -> np.ndarray:
    """Codes of a cell's own motion, -1 where it is aperiodic, and of those beside it."""
    own = codes(*(data[part].transpose("clearance", "ratio").values for part in ("kind", "impacts", "period")))
    return np.concatenate([own[..., None], data["other_code"].transpose("clearance", "ratio", "other").values], axis=-1)


def _points(model: Model, data: xr.Dataset) -> Points:
    """The operating points of a study."""
    settings: dict[str, Any] = json.loads(data.attrs["settings"])
    fixed = {key: value for key, value in settings.items() if key not in ("parameter", "u0", "v0")}
    if "clearance" in data.dims:
        ratio, clearance, amplitude = data["ratio"].values, data["clearance"].values, settings["base_amplitude"]
        at = {"frequency_hz": ratio[None, :] * natural_frequency(model, "a Peterka map"), "gap": clearance[:, None] * amplitude}
        return Points(coords={"clearance": clearance, "ratio": ratio}, values=at | {"base_amplitude": amplitude})
    if "strobe" in data.dims:
        frequency = fixed.pop("frequency_hz")
        return grid({"frequency_hz": [frequency]}, **fixed)
    axes = [settings["parameter"]] if "parameter" in settings else list(map(str, data["impact_force"].dims))
    return grid({axis: data[axis].values for axis in axes}, **fixed)


def own_motions(data: xr.Dataset) -> list[set[int]]:
    """Codes of the motions that the study itself shows, by lane; nothing of what is aperiodic."""
    if "strobe" in data.dims:
        q, touches = section_period(data), data["touches"].values
        return [{(code(int(touches[-q:].sum()), q) if q else APERIODIC_CODE) if touches[-LONGEST:].any() else 0}]
    kind, impacts, period = data["kind"], impacts_in_period(data), data["period"]
    ways = [dict(direction=way) for way in range(kind.sizes["direction"])] if "direction" in kind.dims else [{}]
    own: list[set[int]] = [set() for _ in range(kind.isel(ways[0]).size)]
    for way in ways:
        parts = (part.isel(way).values.ravel().tolist() for part in (kind, impacts, period))
        for lane, (which, p, q) in enumerate(zip(*parts, strict=True)):
            if which in (NO_IMPACT, PERIODIC):
                own[lane].add(code(int(p) if which == PERIODIC else 0, int(q)))
    return own


def impacts_in_period(data: xr.Dataset) -> xr.DataArray:
    """p of z = p/q at each point of a study, from the impacts of each cycle where it has these."""
    impacts = data["impacts"]
    if "cycle" not in impacts.dims:
        return impacts
    back = xr.DataArray(np.arange(impacts.sizes["cycle"])[::-1], dims="cycle")
    return impacts.where(back < data["period"], 0).sum("cycle")


def section_period(data: xr.Dataset) -> int:
    """Cycles after which the motion of a section repeats; 0 where it does not within eight."""
    amplitude, frequency = setting(data, "base_amplitude"), setting(data, "frequency_hz")
    sections = np.stack([data["displacement"].values, data["velocity"].values], axis=1)[..., None]
    scale = section_scales(np.array([amplitude]), np.array([frequency]))
    return int(repeats(sections, scale, ALIKE, LONGEST)[0]) if len(sections) > LONGEST else 0


def evenly(shape: tuple[int, ...], most: Sequence[int]) -> np.ndarray:
    """Which lanes lie on the lines of a lattice that has at most so many, evenly spread, along each axis."""
    chosen = np.zeros(shape, dtype=bool)
    lines = [np.unique(np.linspace(0, size - 1, min(size, few)).round().astype(int)) for size, few in zip(shape, most, strict=True)]
    chosen[np.ix_(*lines)] = True
    return chosen.ravel()
