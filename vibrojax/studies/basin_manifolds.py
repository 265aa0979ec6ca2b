"""Saddles of a picture of basins: their stable manifolds bound the basins, their unstable ones lead to the attractors."""

import json
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial import KDTree

from vibrojax.continuation.branch import comma_separated
from vibrojax.continuation.rig import ForcedRig, check_settings
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, assigned
from vibrojax.studies.manifolds import stable_branch, unstable_branch
from vibrojax.studies.saddles import Saddle, StrobeMap, check_plane, saddles

_NEAR = 1.0
"""Cells from a curve within which a cell counts as on it."""
_BESIDE = 0.1
"""Cells between the points by which the distance from a curve is measured."""
_LISTED = 3

Progress = Callable[[str], None]


class Branch(NamedTuple):
    """One side of a manifold."""

    saddle: int
    """Number of the saddle, from 1."""
    stable: bool
    path: np.ndarray
    """In cells, with rows of NaN where it is broken."""
    lost: bool
    """Whether no next point was found before the region or the length ended it."""


def checked_rig(model: Model, longest: int, u0: np.ndarray, v0: np.ndarray, setting: Mapping[str, Any]) -> ForcedRig:
    """The rig whose saddles of up to so many cycles are sought; known before the basins are computed.

    Arguments:
        model: that of the study.
        longest: cycles.
        u0: initial displacements, m.
        v0: initial velocities, m/s.
        setting: `gap`, `base_amplitude` and `frequency_hz`.

    Raises:
        InputError: a period below one cycle, an effect with a state of its own, a rig without periodic orbits (`check_settings`), or
            initial states that are no grid.
    """
    if longest < 1:
        raise InputError(f"saddles of up to {longest} cycles are asked for: expected at least 1; correct it")
    check_plane(model)
    if not all(side.size > 1 and side[1] > side[0] and np.allclose(np.diff(side), side[1] - side[0], rtol=1e-6) for side in (u0, v0)):
        raise InputError(
            "manifolds are asked for on a picture that is no grid: expected at least 2 evenly increasing values of u0 and of v0"
        )
    rig = ForcedRig(model, gap=setting["gap"], base_amplitude=setting["base_amplitude"], frequency_hz=setting["frequency_hz"])
    check_settings(rig)
    return rig


def with_manifolds(data: xr.Dataset, model: Model, longest: int, progress: Progress = lambda stage: None) -> xr.Dataset:
    """The study with the saddles of up to so many cycles in or near its picture, and the curves that they anchor.

    Arguments:
        data: as `basins` returns it.
        model: that of the study.
        longest: cycles of the longest saddle orbit that is looked for.
        progress: called with each stage.

    Returns:
        The study with `manifold_u` (m), `manifold_v` (m/s), `manifold_saddle` (its number) and `manifold_stable` (1, or 0 on unstable
        manifolds) along `manifold_point`, with NaN between curves; and with the attribute `manifolds`, a table as JSON: of each saddle
        its period, impacts, multipliers, section points, and the
        share of the cells at a boundary of two basins that lies within one cell of its stable manifold. `finding` has a sentence more.

    Raises:
        InputError: as `checked_rig`.
    """
    u0, v0 = (np.asarray(data[name].values, dtype=float) for name in ("u0", "v0"))
    rig = checked_rig(model, longest, u0, v0, json.loads(data.attrs["settings"]))
    cell = np.array([np.diff(u0).mean(), np.diff(v0).mean()])
    plane, shape = StrobeMap(rig, 1, np.array([u0[0], v0[0]]), cell), (u0.size, v0.size)
    border = boundary_cells(data["attractor"].transpose("v0", "u0").values)
    found = saddles(plane, longest, shape, border, progress)
    branches = _branches(plane, found, shape, len(border), progress)
    rows = [_row(number, one, plane, branches, border) for number, one in enumerate(found, 1)]
    everything = np.stack(np.meshgrid(*(np.arange(float(side)) for side in shape)), axis=-1).reshape(-1, 2)
    stable = [branch.path for branch in branches if branch.stable]
    summary = {"longest": longest, "boundary_cells": len(border), "saddles": rows}
    summary |= {"share_of_boundary": share_near(stable, border), "share_of_picture": share_near(stable, everything)}
    said = finding(summary)
    return _with_curves(data, branches, plane).assign_attrs(
        manifolds=json.dumps(summary, allow_nan=False), finding="; ".join(part for part in (data.attrs.get("finding", ""), said) if part)
    )


def boundary_cells(colours: np.ndarray) -> np.ndarray:
    """Column and row of every cell with a neighbour above, below or beside it of another colour; cells without colour (-1) left out.

    Example:
        >>> boundary_cells(np.array([[0, 0, 1, 1]])).tolist()
        [[1.0, 0.0], [2.0, 0.0]]
    """
    edge = np.zeros(colours.shape, dtype=bool)
    for one, other in ((np.s_[1:, :], np.s_[:-1, :]), (np.s_[:, 1:], np.s_[:, :-1])):
        differs = (colours[one] != colours[other]) & (colours[one] >= 0) & (colours[other] >= 0)
        edge[one] |= differs
        edge[other] |= differs
    return np.argwhere(edge)[:, ::-1].astype(float)


def share_near(paths: list[np.ndarray], cells: np.ndarray) -> float:
    """Share of the cells whose centre lies within one cell of a curve; 0 without cells or curves."""
    dense = [_densely(path) for path in paths]
    points = np.concatenate(dense) if dense else np.zeros((0, 2))
    if not len(points) or not len(cells):
        return 0.0
    return float(np.mean(KDTree(points).query(cells)[0] <= _NEAR))


def manifold_table(data: xr.Dataset) -> str:
    """The curves as comma-separated text with a header: a row a point; curves, and the parts of a broken one, are numbered."""
    u, v, saddle, stable = (data[f"manifold_{name}"].values for name in ("u", "v", "saddle", "stable"))
    known = np.isfinite(u)
    begins = known & ~np.insert(known, 0, False)[:-1]
    columns = {"curve": np.cumsum(begins), "saddle": saddle, "manifold": np.where(stable, "stable", "unstable"), "u_m": u, "v_m_per_s": v}
    return comma_separated({name: column[known] for name, column in columns.items()})


def finding(summary: dict[str, Any]) -> str:
    """One sentence: which saddles, and how much of the boundary their stable manifolds account for."""
    rows, longest = summary["saddles"], summary["longest"]
    up_to = "1 cycle" if longest == 1 else f"up to {longest} cycles"
    if not rows:
        return f"no saddle of {up_to} found in or near the picture"
    rows = sorted(rows, key=lambda row: -row["share_of_boundary"])
    named = [_named(row) for row in rows[:_LISTED]]
    more = f" and {len(rows) - _LISTED} more" if len(rows) > _LISTED else ""
    lead = f"{len(rows)} saddle{'s' * (len(rows) > 1)} of {up_to}: {', '.join(named)}{more}"
    if not summary["boundary_cells"]:
        return f"{lead}; the picture has no boundary"
    lost = sum(row["branches_lost"] for row in rows)
    short = f"; {lost} of their branches could not be followed to their end" if lost else ""
    passes = "its stable manifold passes" if len(rows) == 1 else "their stable manifolds pass"
    return (
        f"{lead}; {passes} within one cell of {100 * summary['share_of_boundary']:.1f} % of the "
        f"{summary['boundary_cells']} cells at a boundary of two basins (of all cells {100 * summary['share_of_picture']:.1f} %){short}"
    )


def _named(row: dict[str, Any]) -> str:
    kind = f"z = {row['impacts']}/{row['period']}" if row["impacts"] else f"no impact in {row['period']}"
    outside, inside = row["multipliers"]
    u, v = row["section"]["u"][0], row["section"]["v"][0]
    return f"{kind} at {1e3 * u:.4g} mm, {v:.4g} m/s with multipliers {outside:.4g} and {inside:.3g}"


def _branches(plane: StrobeMap, found: list[Saddle], shape: tuple[int, int], border: int, progress: Progress) -> list[Branch]:
    """Both sides of both manifolds of every section point.

    Curves end one side of the picture beyond the picture and the saddles. All stable ones together may be twice as long as the boundary,
    and each of them as long as a way round the picture besides.
    """
    side = np.array(shape, dtype=float)
    centres = np.concatenate([np.zeros((1, 2)), *(one.points for one in found)])
    room: dict[str, Any] = {"low": centres.min(axis=0) - side, "high": np.maximum(centres.max(axis=0), side) + side}
    sides = 2 * sum(one.cycles for one in found)
    longest, result = 2.0 * border / max(sides, 1) + 2.0 * float(side.sum()), list[Branch]()
    for number, one in enumerate(found, 1):
        outside, _ = one.multipliers
        cycles = one.cycles if outside > 0 else 2 * one.cycles
        power = StrobeMap(plane.rig, cycles, plane.origin, plane.cell)
        growth = abs(outside) ** (cycles // one.cycles)
        for orbit, point in zip(one.orbits, one.points, strict=True):
            values, vectors = np.linalg.eig(orbit.monodromy * plane.cell / plane.cell[:, None])
            order = np.argsort(np.abs(values))
            inwards, outwards = (np.real(vectors[:, order[i]]) for i in (0, 1))
            for sign in (1.0, -1.0):
                progress(f"manifolds of saddle {number} of {len(found)}: branch {1 + len(result) // 2} of {sides}")
                path, lost = stable_branch(power, point, sign * inwards, longest=longest, **room)
                result.append(Branch(number, True, path, lost))
                path = unstable_branch(power, point, sign * outwards, growth, longest=longest, **room)
                result.append(Branch(number, False, path, False))
    return result


def _row(number: int, one: Saddle, plane: StrobeMap, branches: list[Branch], border: np.ndarray) -> dict[str, Any]:
    """A saddle as JSON can hold it."""
    mine = [branch for branch in branches if branch.saddle == number and branch.stable]
    states = plane.states(one.points)
    return {
        "saddle": number,
        "period": one.cycles,
        "impacts": one.orbits[0].touches,
        "multipliers": list(one.multipliers),
        "section": {"u": states[:, 0].tolist(), "v": states[:, 1].tolist()},
        "share_of_boundary": share_near([branch.path for branch in mine], border),
        "branches_lost": sum(branch.lost for branch in mine),
    }


def _with_curves(data: xr.Dataset, branches: list[Branch], plane: StrobeMap) -> xr.Dataset:
    gap = np.full((1, 2), np.nan)
    paths = [np.concatenate([plane.states(branch.path), gap]) for branch in branches]
    states = np.concatenate([gap[:0], *paths])
    numbers = [np.repeat([[branch.saddle, int(branch.stable)]], len(path), axis=0) for branch, path in zip(branches, paths, strict=True)]
    saddle, stable = np.concatenate([np.zeros((0, 2), dtype=int), *numbers]).astype(np.int32).T
    along = ("manifold_point",)
    variables = {
        "manifold_u": Labelled(along, states[:, 0], "m", "displacement on a manifold of a saddle"),
        "manifold_v": Labelled(along, states[:, 1], "m/s", "velocity on it"),
        "manifold_saddle": Labelled(along, saddle, "1", "number of the saddle"),
        "manifold_stable": Labelled(along, stable, "1", "1 stable manifold, 0 unstable manifold"),
    }
    return assigned(data, variables)


def _densely(path: np.ndarray) -> np.ndarray:
    """Points on a curve, nowhere farther apart than `_BESIDE`."""
    ends = np.isfinite(path[1:, 0]) & np.isfinite(path[:-1, 0])
    a, step = path[:-1][ends], np.diff(path, axis=0)[ends]
    count = np.maximum(np.ceil(np.linalg.norm(step, axis=1) / _BESIDE).astype(int), 1)
    part = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(a, count, axis=0) + np.repeat(step / count[:, None], count, axis=0) * part[:, None]
