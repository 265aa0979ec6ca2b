"""Basins of attraction over the initial state."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Points, Span, grid
from vibrojax.model import Model
from vibrojax.studies.attractors import Attractor, Sections, attractors, share
from vibrojax.studies.base import Labelled, Values, axis, labelled, outcome
from vibrojax.studies.basin_measures import boundary, entropy, integrity
from vibrojax.studies.classify import FAILED, MEANING, NO_IMPACT
from vibrojax.studies.settled import scales, settled

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
    **options: Any,
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
        options: of `vibrojax.batch.integrate`.

    Returns:
        On the axes (`v0`, `u0`): `attractor` (its number; -1 where the integration failed), `impacting` (1, 0; -1), `kind`, `impacts` and
        `period` of z = p/q, `lyapunov` where the motion does not repeat, and `displacement` at the last strobe. Attributes:
        `basin_measure` is the share of the initial states whose motion keeps impacting, `attractors` a table as JSON (name, share and its
        95 % interval, section points, radii of the discs of `basin_measures.integrity`), `basin_entropy`, `boundary_basin_entropy`,
        `uncertainty_exponent` with its standard error and `boundary_dimension` (see `basin_measures`), NaN where there is no boundary.
    """
    setting = {"frequency_hz": frequency_hz, "gap": gap, "base_amplitude": base_amplitude}
    return measured(states(model, u0=u0, v0=v0, span=span, most_cycles=most_cycles, **setting, **options))


def states(
    model: Model,
    *,
    u0: Values,
    v0: Values,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
    most_cycles: int | None = None,
    **options: Any,
) -> xr.Dataset:
    """What each initial state has for itself: the study before motions are compared. Arguments are those of `basins`."""
    setting = {"frequency_hz": frequency_hz, "gap": gap, "base_amplitude": base_amplitude}
    points = grid({"v0": v0, "u0": u0}, **setting)
    return settled_states(model, points, "basins of attraction", setting, span=span, most_cycles=most_cycles, **options)


def settled_states(model: Model, points: Points, title: str, setting: Mapping[str, Any], **options: Any) -> xr.Dataset:
    """The data set of a study whose points differ in the initial state, and in a parameter where the first axis is one."""
    found, kind, growth = settled(model, points, **options)
    impacting = np.where(kind.kind == FAILED, -1, (kind.kind != NO_IMPACT).astype(int))
    dims = tuple(points.coords)
    return labelled(
        title,
        model,
        found,
        coords={name: axis(model, name, values) for name, values in points.coords.items()},
        variables={
            "impacting": Labelled(dims, impacting, "1", "whether the motion keeps impacting"),
            "kind": Labelled(dims, kind.kind, "1", MEANING),
            "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
            "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
            "lyapunov": Labelled(dims, growth, "1", "largest Lyapunov exponent per cycle of excitation"),
            "displacement": Labelled(dims, found.u[..., -1], "m", "displacement at the last strobe"),
            SECTION[0]: Labelled((*dims, "strobe"), found.u, "m", "displacement at the last strobes"),
            SECTION[1]: Labelled((*dims, "strobe"), found.v, "m/s", "velocity at the last strobes"),
            "result": outcome(dims, found.result),
        },
        settings=setting,
    )


def measured(data: xr.Dataset) -> xr.Dataset:
    """The study with what can only be said of all its initial states together; section points stay with the attractors alone."""
    setting = json.loads(data.attrs["settings"])
    scale = scales(np.asarray(setting["base_amplitude"]), np.asarray(setting["frequency_hz"]))
    label, found = attractors(sections(data, scale))
    colours = label.reshape(data["kind"].shape)
    u0, v0 = (data[name].values for name in ("u0", "v0"))
    attrs = {"basin_measure": _impacting(data)}
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
    return (
        data.drop_vars(SECTION)
        .assign(attractor=(data["kind"].dims, colours, meaning))
        .assign_attrs(attrs | {"attractors": json.dumps(rows, allow_nan=False)})
    )


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


def _impacting(data: xr.Dataset) -> float:
    """Share of the initial states that keep impacting; NaN where none could be integrated."""
    impacting = data["impacting"].values
    return float(np.mean(impacting[impacting >= 0] == 1)) if np.any(impacting >= 0) else float("nan")
