"""Continuation of basin fractions: the shares of the attractors along a parameter, each attractor followed from value to value."""

import json
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial import KDTree

from vibrojax.batch import Points, Span
from vibrojax.batch.points import section_scales
from vibrojax.model import Model
from vibrojax.studies.attractors import Attractor, Sections, attractors, settled, share
from vibrojax.studies.base import Labelled, Values, assigned
from vibrojax.studies.basins import SECTION, sections, states, with_basin_measure
from vibrojax.studies.bifurcation import increasing

NUMBER = "attractor_number"
_LISTED = 5


def basins_along(
    model: Model,
    *,
    parameter: str,
    values: Values,
    u0: Values,
    v0: Values,
    span: Span | None = None,
    most_cycles: int | None = None,
    threads: int | None = None,
    **fixed: float,
) -> xr.Dataset:
    """Basins at each value of a parameter, with attractors that keep their number along it.

    From each attractor at one value a motion is started at the next: the attractor on which it settles takes over the number. Where
    several settle on one, the nearest keeps its number and the others end; where a motion settles on what no initial state of the grid
    reaches, the attractor goes on with the share 0. An attractor that none leads to is new.

    Arguments:
        model: the rig.
        parameter: what varies: `frequency_hz`, `gap`, `base_amplitude` or a parameter of the model.
        values: increasing, at least 3.
        u0: initial displacements relative to the cart, m.
        v0: initial velocities, m/s.
        span: how long, at first.
        most_cycles: how long at most, see `settled`.
        threads: chunks of lanes at a time; by default one a core.
        fixed: the other settings.

    Returns:
        What `basins` has of each initial state, on the axes (parameter, `v0`, `u0`); `share`, `share_low` and `share_high` (95 %),
        `attractor_impacts` and `attractor_period` on the axes (parameter, `attractor_number`), the share NaN where the attractor does not
        exist. The attribute `attractors` is a table as JSON.

    Source: G. Datseris, K. L. Rossi, A. Wagemakers, Framework for global stability analysis of dynamical systems, Chaos 33 (2023) 073151:
    continuation of basin fractions by seeding from the attractors of the value before. They match by distance; we match by where the
    seeded motion goes, and by distance only where several go to one.
    """
    increasing(parameter, values)
    more: dict[str, Any] = {"span": span, "most_cycles": most_cycles, "threads": threads} | fixed
    return matched(model, with_basin_measure(states(model, parameter=parameter, values=values, u0=u0, v0=v0, **more)))


Track = dict[int, Attractor]
"""One attractor along the parameter, by the place of the value."""


def matched(model: Model, data: xr.Dataset) -> xr.Dataset:
    """The study with attractors that keep their numbers along the parameter, and their shares.

    Arguments:
        model: the rig.
        data: as `states` returns it.
    """
    setting = json.loads(data.attrs["settings"])
    parameter, transient, most = (setting.pop(name) for name in ("parameter", "transient", "most_cycles"))
    until: dict[str, Any] = {"span": Span(transient=transient, recorded=data.sizes["strobe"]), "most_cycles": most}
    colours, tracks, scale = np.full(data["kind"].shape, -1), list[Track](), np.ones(2)
    for place, value in enumerate(data[parameter].values):
        at = setting | {parameter: float(value)}
        before, scale = scale, section_scales(np.asarray(at["base_amplitude"]), np.asarray(at["frequency_hz"]))
        label, found = attractors(sections(data.isel({parameter: place}), scale))
        last = [track for track in tracks if place - 1 in track]
        seeds = _seeded(model, at, [track[place - 1].points[0] * before for track in last], scale, until)
        owners, lost = _successors([track[place - 1] for track in last], found, seeds)
        for number, one in enumerate(found):
            track: Track = last[owners[number]] if number in owners else {}
            track[place] = one
            if number not in owners:
                tracks.append(track)
            mine = next(index for index, other in enumerate(tracks) if other is track)
            colours[place][label.reshape(colours[place].shape) == number] = mine
        for index, one in lost.items():
            last[index][place] = one
    return _described(data.drop_vars(SECTION), parameter, colours, tracks)


def _seeded(model: Model, at: dict[str, float], starts: list[np.ndarray], scale: np.ndarray, until: dict[str, Any]) -> Sections | None:
    """Where motions settle at one value that begin on the attractors of the value before."""
    if not starts:
        return None
    u0, v0 = np.array(starts).T
    points = Points(coords={"seed": np.arange(float(len(starts)))}, values=at | {"u0": u0, "v0": v0})
    found, kind, growth = settled(model, points, **until)
    return Sections(np.stack([found.u, found.v], axis=-1) / scale, *kind, growth)


def _successors(before: list[Attractor], found: list[Attractor], seeds: Sections | None) -> tuple[dict[int, int], dict[int, Attractor]]:
    """Which attractor each of those found goes on from, and where the others go on that no initial state of the grid leads to.

    Returns:
        By number of the one found, the number of the one before; by number of the one before, the one that only its seed found.
    """
    if seeds is None:
        return {}, {}
    label, groups = attractors(_together(found, seeds))
    group_of, goes_to = label[: len(found)].tolist(), label[len(found) :].tolist()
    owners, lost, taken = dict[int, int](), dict[int, Attractor](), set[int]()
    for index in sorted(range(len(before)), key=lambda index: _distance(before[index], groups[goes_to[index]], goes_to[index])):
        group = goes_to[index]
        if group < 0 or group in taken:
            continue
        if group in group_of:
            owners[group_of.index(group)] = index
            taken.add(group)
        elif groups[group].period > 0:
            lost[index] = groups[group]._replace(lanes=0)
            taken.add(group)
    return owners, lost


def _together(found: list[Attractor], seeds: Sections) -> Sections:
    """Attractors, a lane each, and seeds."""
    strobes = seeds.points.shape[1]
    rows = [np.resize(one.points[::-1], (strobes, 2))[::-1] for one in found]
    names = ("kind", "impacts", "period", "lyapunov")
    columns = [np.array([getattr(one, name) for one in found], np.asarray(getattr(seeds, name)).dtype) for name in names]
    points = np.concatenate([np.array(rows).reshape(-1, strobes, 2), seeds.points])
    return Sections(points, *(np.concatenate([new, old]) for new, old in zip(columns, seeds[1:], strict=True)))


def _distance(one: Attractor, other: Attractor, group: int) -> float:
    """Largest distance from a section point of either to the nearest of the other."""
    if group < 0:
        return float("inf")
    there, back = KDTree(other.points).query(one.points)[0], KDTree(one.points).query(other.points)[0]
    return float(max(np.max(there), np.max(back)))


def _described(data: xr.Dataset, parameter: str, colours: np.ndarray, tracks: list[Track]) -> xr.Dataset:
    """The study with shares, p and q, and the table of attractors."""
    values, shape = data[parameter].values, (data.sizes[parameter], len(tracks))
    totals = (colours >= 0).reshape(shape[0], -1).sum(axis=1)
    part = np.full((3, *shape), np.nan)
    p, q = np.full(shape, -1), np.full(shape, -1)
    for number, track in enumerate(tracks):
        for place, one in track.items():
            part[:, place, number] = share(one.lanes, int(totals[place]))
            p[place, number], q[place, number] = one.impacts, one.period
    dims = (parameter, NUMBER)
    variables = {
        "share": Labelled(dims, part[0], "1", "share of the initial states"),
        "share_low": Labelled(dims, part[1], "1", "lower end of its 95 % interval"),
        "share_high": Labelled(dims, part[2], "1", "upper end of its 95 % interval"),
        "attractor": Labelled(tuple(map(str, data["kind"].dims)), colours, "1", "number of the attractor; -1: not integrated"),
        "attractor_impacts": Labelled(dims, p, "1", "impacts in one period; -1: no such attractor"),
        "attractor_period": Labelled(dims, q, "1", "cycles in one period, 0: none; -1: no such attractor"),
    }
    table = [{"values": [float(values[place]) for place in track], "motions": [one.motion for one in track.values()]} for track in tracks]
    return assigned(data, variables).assign_attrs(attractors=json.dumps(table), finding=_finding(data, parameter, part[0], tracks))


def _finding(data: xr.Dataset, parameter: str, part: np.ndarray, tracks: list[Track]) -> str:
    """One sentence: where each attractor exists, and its largest share."""
    values, unit = data[parameter].values, data[parameter].attrs["units"]
    order = sorted(range(len(tracks)), key=lambda number: -np.nanmax(part[:, number]))
    words = []
    for number in order[:_LISTED]:
        track, places = tracks[number], sorted(tracks[number])
        names = list(dict.fromkeys(track[place].motion for place in places))
        best = int(np.nanargmax(part[:, number]))
        until = f" to {values[places[-1]]:.4g}" if len(places) > 1 else ""
        most = f"largest share {100 * part[best, number]:.0f} % at {values[best]:.4g}"
        words.append(f"{' then '.join(names[:3])} at {values[places[0]]:.4g}{until} {unit} ({most})")
    rest = f"; {len(tracks) - _LISTED} more" if len(tracks) > _LISTED else ""
    return f"{len(tracks)} attractors along {parameter}: {'; '.join(words)}{rest}"
