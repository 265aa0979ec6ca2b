"""Basins of attraction over the initial state, and how tangled they are, and how large a disturbance each attractor bears."""

import json
import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial import KDTree
from scipy.stats import linregress

from vibrojax.batch import Span, grid
from vibrojax.batch.points import section_scales
from vibrojax.model import Model
from vibrojax.studies.attractors import Attractor, Sections, attractors, settled, share
from vibrojax.studies.base import FAILED, NO_IMPACT, Labelled, Values, axis, labelled, motions

BOX = 5
"""Points along the side of a box in which colours are counted, as in the paper."""
_STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
_BLOCKS = 4
_PART = 8
"""Disturbances are at most the side of the picture over this."""


class Entropy(NamedTuple):
    """In nats; NaN where the picture holds no whole box (of the boundary: no box of two colours)."""

    basin: float
    """S_b: mean over all boxes."""
    boundary: float
    """S_bb: mean over the boxes with more than one colour; above ln 2 only if the boundary is fractal."""


class Boundary(NamedTuple):
    """How the share of uncertain initial states falls with the size of the disturbance; NaN where there is no boundary."""

    exponent: float
    """alpha: f(epsilon) ~ epsilon^alpha."""
    stderr: float
    """Of alpha."""
    dimension: float
    """2 - alpha: 1 of a smooth boundary."""


class Integrity(NamedTuple):
    """Of one attractor, lengths in m: a displacement by r, or a velocity by r Omega."""

    local: float
    """Radius of the largest disc in its basin around each of its section points, the least of them; NaN where one lies outside."""
    largest: float
    """Radius of the largest disc anywhere in its basin."""
    bounded: bool
    """Whether the edge of the picture, not another basin, ends the first disc: the true radius is larger."""
    resolution: float
    """Largest distance of neighbours in the picture, m: the border lies at most so much nearer than the radii say."""


def entropy(colours: np.ndarray) -> Entropy:
    """Basin entropy of a picture of numbered basins, `(rows, columns)`; boxes with a negative number are left out.

    Source: A. Daza, A. Wagemakers, B. Georgeot, D. Guéry-Odelin, M. A. F. Sanjuán, Basin entropy: a new tool to analyze uncertainty in
    dynamical systems, Scientific Reports 6 (2016) 31416, eqs. 5 and 6.

    Example:
        >>> entropy(np.array([[0] * 5 + [1] * 5] * 5))
        Entropy(basin=0.0, boundary=nan)
    """
    rows, columns = (side // BOX for side in colours.shape)
    boxes = colours[: rows * BOX, : columns * BOX].reshape(rows, BOX, columns, BOX).swapaxes(1, 2).reshape(-1, BOX * BOX)
    boxes = boxes[(boxes >= 0).all(axis=1)]
    if not len(boxes):
        return Entropy(float("nan"), float("nan"))
    part = np.stack([(boxes == colour).mean(axis=1) for colour in range(boxes.max() + 1)])
    each = -np.sum(part * np.log(np.where(part > 0, part, 1.0)), axis=0)
    mixed = each > 0
    return Entropy(float(each.mean()) + 0.0, float(each[mixed].mean()) if mixed.any() else float("nan"))


def boundary(colours: np.ndarray) -> Boundary:
    """Uncertainty exponent: a state is uncertain where one of its four neighbours at a distance has another colour.

    Distances are multiples of the spacing of the picture, up to an eighth of its shorter side. The error is that of the straight line and,
    by the jackknife over sixteen blocks of the picture, that of what is in it, added in squares.

    Source: S. W. McDonald, C. Grebogi, E. Ott, J. A. Yorke, Fractal basin boundaries, Physica D 17 (1985) 125-153; the error is ours.
    """
    steps = np.array([k for k in _STEPS if k <= min(colours.shape) // _PART])
    nothing = Boundary(float("nan"), float("nan"), float("nan"))
    if steps.size < 3:
        return nothing
    counts = np.array([_uncertain(colours, int(k), int(steps[-1])) for k in steps])
    slope, off = _slope(steps, counts.sum(axis=1))
    if not np.isfinite(slope):
        return nothing
    blocks = counts.shape[1]
    left_out = np.array([_slope(steps, counts.sum(axis=1) - counts[:, block])[0] for block in range(blocks)])
    spread = float((blocks - 1) / blocks * np.nansum((left_out - np.nanmean(left_out)) ** 2))
    return Boundary(slope, float(np.sqrt(off**2 + spread)), 2.0 - slope)


def _slope(steps: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """Slope of log share on log distance, and its error; NaN where fewer than three distances have uncertain states."""
    seen = counts[:, 0] > 0
    if seen.sum() < 3:
        return float("nan"), float("nan")
    line: Any = linregress(np.log(steps[seen]), np.log(counts[seen, 0] / counts[seen, 1]))
    return float(line.slope), float(line.stderr)


def _uncertain(colours: np.ndarray, k: int, edge: int) -> np.ndarray:
    """Of each block of the picture: how many points differ from a neighbour k away, and of how many; those at the edge left out."""
    rows, columns = (slice(edge, side - edge) for side in colours.shape)
    middle = colours[rows, columns]
    around = [np.roll(colours, shift, axis)[rows, columns] for axis in (0, 1) for shift in (-k, k)]
    known = (middle >= 0) & np.all([part >= 0 for part in around], axis=0)
    differs = known & np.any([part != middle for part in around], axis=0)
    row, column = ((_BLOCKS * np.arange(side)) // side for side in middle.shape)
    block = (_BLOCKS * row[:, None] + column[None, :]).reshape(-1)
    return np.stack([np.bincount(block, part.reshape(-1), minlength=_BLOCKS**2) for part in (differs, known)], axis=1)


def integrity(colours: np.ndarray, u0: np.ndarray, v0: np.ndarray, sections: list[np.ndarray], omega: float) -> list[Integrity]:
    """Room around each attractor, in the plane of u and u' / Omega.

    Arguments:
        colours: number of the attractor of each initial state, `(v0, u0)`.
        u0: m, increasing.
        v0: m/s, increasing.
        sections: (u, u') of each attractor at the strobes, `(points, 2)`, in the order of their numbers.
        omega: Omega of the cart, rad/s.

    Source: G. Rega, S. Lenci, Identifying, evaluating, and controlling dynamical integrity measures in non-linear mechanical oscillators,
    Nonlinear Analysis 63 (2005) 902-914: local integrity measure and integrity factor; for the idea J. M. T. Thompson, Chaotic phenomena
    triggering the escape from a potential well, Proc. R. Soc. A 421 (1989) 195-225. The scale of velocity is ours.
    """
    plane = np.stack(np.meshgrid(u0, v0 / omega), axis=-1).reshape(-1, 2)
    colour, result = colours.reshape(-1), []
    low, high = plane.min(axis=0), plane.max(axis=0)
    resolution = float(np.hypot(np.diff(u0).max(), np.diff(v0).max() / omega))
    for number, points in enumerate(sections):
        places = np.stack([points[:, 0], points[:, 1] / omega], axis=1)
        strange = plane[colour != number]
        tree = KDTree(strange) if len(strange) else None
        inside = bool(((places >= low) & (places <= high)).all())
        other, edge = _room(tree, places), np.minimum(places - low, high - places).min(axis=1)
        here = plane[colour == number]
        anywhere = np.minimum(_room(tree, here), np.minimum(here - low, high - here).min(axis=1)).max(initial=0.0)
        local = float(np.minimum(other, edge).min()) if inside else float("nan")
        result.append(Integrity(local, float(np.fmax(anywhere, local)), inside and bool(edge.min() <= other.min()), resolution))
    return result


def _room(strange: KDTree | None, places: np.ndarray) -> np.ndarray:
    """Distance from each place to the nearest initial state of another basin."""
    return np.full(len(places), np.inf) if strange is None else np.asarray(strange.query(places)[0])


SECTION = ("section_displacement", "section_velocity")
"""Variables that hold the last section points of every motion until the attractors are known."""


def basins(
    model: Model,
    *,
    u0: Values,
    v0: Values,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
    most_cycles: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Which attractor each initial state leads to.

    Arguments:
        model: the rig.
        u0: initial displacements relative to the cart, m.
        v0: initial velocities, m/s.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        span: how long, at first.
        most_cycles: how long at most, see `settled`.
        threads: chunks of lanes at a time; by default one a core.

    Returns:
        On the axes (`v0`, `u0`): `attractor` (its number; -1 where the integration failed), `impacting` (1, 0; -1), `kind`, `impacts` and
        `period` of z = p/q, `lyapunov` where the motion does not repeat, and `cycles` that were integrated, largest `impact_speed` (m/s)
        and `displacement` at the last strobe. Attributes:
        `basin_measure` is the share of the initial states whose motion keeps impacting, `attractors` a table as JSON (name, share and its
        95 % interval, section points, radii of the discs of `integrity`), `basin_entropy`, `boundary_basin_entropy`,
        `uncertainty_exponent` with its standard error and `boundary_dimension` (`entropy`, `boundary`), NaN where there is no boundary.
    """
    until: dict[str, Any] = {"span": span, "most_cycles": most_cycles, "threads": threads}
    return measured(states(model, u0=u0, v0=v0, **until, frequency_hz=frequency_hz, gap=gap, base_amplitude=base_amplitude))


def states(
    model: Model,
    *,
    u0: Values,
    v0: Values,
    parameter: str | None = None,
    values: Values = (),
    span: Span | None = None,
    most_cycles: int | None = None,
    threads: int | None = None,
    **fixed: float,
) -> xr.Dataset:
    """What each initial state has for itself, at one operating point or at each value of a parameter: before motions are compared.

    Arguments are those of `basins` and `basins_along`.
    """
    points = grid(({} if parameter is None else {parameter: values}) | {"v0": v0, "u0": u0}, **fixed)
    found, kind, growth = settled(model, points, span=span, most_cycles=most_cycles, threads=threads)
    impacting = np.where(kind.kind == FAILED, -1, (kind.kind != NO_IMPACT).astype(int))
    dims = tuple(points.coords)
    along = {"parameter": parameter, "transient": (span or Span()).transient, "most_cycles": most_cycles}
    return labelled(
        "basins of attraction" if parameter is None else f"basins of attraction along {parameter}",
        model,
        found,
        coords={name: axis(model, name, values) for name, values in points.coords.items()},
        variables={
            "impacting": Labelled(dims, impacting, "1", "whether the motion keeps impacting"),
            **motions(dims, kind, found.result),
            "lyapunov": Labelled(dims, growth, "1", "largest Lyapunov exponent per cycle of excitation"),
            "cycles": Labelled(dims, found.cycles, "1", "cycles integrated, until the orbit had closed"),
            "impact_speed": Labelled(dims, found.impact_speed.max(axis=-1), "m/s", "largest approach speed of the last cycles"),
            "displacement": Labelled(dims, found.u[..., -1], "m", "displacement at the last strobe"),
            SECTION[0]: Labelled((*dims, "strobe"), found.u, "m", "displacement at the last strobes"),
            SECTION[1]: Labelled((*dims, "strobe"), found.v, "m/s", "velocity at the last strobes"),
        },
        settings=fixed if parameter is None else fixed | along,
    )


def measured(data: xr.Dataset) -> xr.Dataset:
    """The study with what can only be said of all its initial states together; section points stay with the attractors alone."""
    setting = json.loads(data.attrs["settings"])
    scale = section_scales(np.asarray(setting["base_amplitude"]), np.asarray(setting["frequency_hz"]))
    label, found = attractors(sections(data, scale))
    colours = label.reshape(data["kind"].shape)
    u0, v0 = (data[name].values for name in ("u0", "v0"))
    attrs: dict[str, Any] = dict(with_basin_measure(data).attrs)
    if picture := min(colours.shape) > 1 and all(np.all(np.diff(side) > 0) for side in (u0, v0)):
        mixed, rough = entropy(colours), boundary(colours)
        attrs |= {
            "basin_entropy": mixed.basin,
            "boundary_basin_entropy": mixed.boundary,
            "uncertainty_exponent": rough.exponent,
            "uncertainty_exponent_stderr": rough.stderr,
            "boundary_dimension": rough.dimension,
        }
    omega, places = 2.0 * math.pi * setting["frequency_hz"], [one.points * scale for one in found]
    rooms = integrity(colours, u0, v0, places, omega) if picture else [None] * len(found)
    total = int(np.sum(label >= 0))
    rows = [row(one, total, place) for one, place in zip(found, places, strict=True)]
    for one, room, attractor in zip(rows, rooms, found, strict=True):
        if room is not None and (attractor.period > 0 or attractor.name.startswith("chaotic")):
            one["integrity"] = {
                "displacement": number(room.local),
                "velocity": number(room.local * omega),
                "limited_by_picture": room.bounded,
                "resolution": {"displacement": room.resolution, "velocity": room.resolution * omega},
                "largest_disc": number(room.largest),
            }
    meaning = {"units": "1", "long_name": "number of the attractor, that of most initial states first; -1: not integrated"}
    attrs["attractors"] = json.dumps(rows, allow_nan=False)
    return data.drop_vars(SECTION).assign(attractor=(data["kind"].dims, colours, meaning)).assign_attrs(attrs)


def sections(data: xr.Dataset, scale: np.ndarray) -> Sections:
    """What is compared of each motion, from the variables of `states`."""
    names = ("kind", "impacts", "period", "lyapunov")
    points = np.stack([data[name].values for name in SECTION], axis=-1) / scale
    return Sections(points.reshape(-1, *points.shape[-2:]), *(data[name].values.reshape(-1) for name in names))


def row(one: Attractor, total: int, places: np.ndarray) -> dict[str, Any]:
    """An attractor as JSON can hold it."""
    part, low, high = share(one.lanes, total)
    return {
        "name": one.name,
        "impacts": one.impacts,
        "period": one.period,
        "initial_states": one.lanes,
        "share": part,
        "share_ci95": [low, high],
        "lyapunov": number(one.lyapunov),
        "section": {"u": places[:, 0].tolist(), "v": places[:, 1].tolist()},
    }


def number(value: float) -> float | None:
    """A number as JSON has it: None where it is not finite."""
    return float(value) if math.isfinite(value) else None


def with_basin_measure(data: xr.Dataset) -> xr.Dataset:
    """The study with the attribute `basin_measure`: the share of the initial states that keep impacting, NaN where none was integrated."""
    impacting = data["impacting"].values
    return data.assign_attrs(basin_measure=float(np.mean(impacting[impacting >= 0] == 1)) if np.any(impacting >= 0) else float("nan"))
