"""What a picture of basins shows, in one sentence; where it shows one colour, the nearest settings at which several attractors coexist."""

import json
import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from vibrojax.batch import Points, Span
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.model import Model
from vibrojax.studies.attractors import Sections, attractors
from vibrojax.studies.settled import scales, settled

_LISTED = 5
"""Attractors that are named one by one."""
_FACTORS = np.geomspace(2.0**-0.5, 2.0**0.5, 21)
_STARTS = 4
"""Initial states along each axis."""
_WIDER = 1.5
"""Times as wide as the picture: attractors may lie beyond it."""


class Place(NamedTuple):
    """A value of one setting, all others kept, at which motions settle differently."""

    setting: str
    """"gap" or "frequency_hz"."""
    value: float
    """SI."""
    names: tuple[str, ...]
    """Of the attractors that were seen."""


def with_finding(model: Model, data: xr.Dataset) -> xr.Dataset:
    """The study with its attribute `finding`.

    Arguments:
        model: the rig.
        data: as `basins` returns it.
    """
    rows = json.loads(data.attrs["attractors"])
    places = _elsewhere(model, data) if len(rows) == 1 else []
    return data.assign_attrs(finding=finding(data, places))


def document(data: xr.Dataset) -> str:
    """What a study of basins found, without its picture, as JSON."""
    numbers = {name: value if math.isfinite(value) else None for name, value in data.attrs.items() if isinstance(value, float)}
    numbers.pop("seconds", None)
    found = {"finding": data.attrs.get("finding", ""), "settings": json.loads(data.attrs["settings"])}
    found |= {"manifolds": json.loads(data.attrs["manifolds"])} if "manifolds" in data.attrs else {}
    return json.dumps(found | numbers | {"attractors": json.loads(data.attrs["attractors"])}, indent=1, allow_nan=False) + "\n"


def finding(data: xr.Dataset, places: list[Place]) -> str:
    """One sentence: which attractors, how the boundary is, what the leading motion bears; or where several coexist.

    Arguments:
        data: as `basins` returns it.
        places: where attractors coexist, for a picture of one colour.
    """
    rows = json.loads(data.attrs["attractors"])
    if not rows:
        return "no initial state could be integrated"
    if len(rows) == 1:
        return _one_colour(rows[0], places)
    shares = [f"{one['name']} takes {percent(one)}" for one in rows[:_LISTED]]
    rest = 100 * sum(one["share"] for one in rows[_LISTED:])
    shares += [f"{len(rows) - _LISTED} others {rest:.1f} %"] if len(rows) > _LISTED else []
    lead = f"{len(rows)} attractors: {', '.join(shares)} of the initial states"
    return "; ".join([lead, *_border(data), *_room(rows)])


def percent(one: dict[str, Any]) -> str:
    """The share of an attractor with its 95 % interval."""
    low, high = one["share_ci95"]
    return f"{100 * one['share']:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _border(data: xr.Dataset) -> list[str]:
    """How smooth the boundary is; nothing where the picture does not show it."""
    dimension, stderr, mixed = (
        data.attrs.get(name, math.nan) for name in ("boundary_dimension", "uncertainty_exponent_stderr", "boundary_basin_entropy")
    )
    if not math.isfinite(dimension):
        return []
    words = f"the boundary has dimension {dimension:.2f} ± {stderr:.2f}"
    if math.isfinite(mixed) and mixed > math.log(2.0):
        return [f"{words} and S_bb {mixed:.2f} > ln 2: it is fractal"]
    return [words]


def _room(rows: list[dict[str, Any]]) -> list[str]:
    """What the attractors bear whose section points lie in the picture."""
    known = [(one["name"], bears(one)) for one in rows[:_LISTED]]
    each = [f"{name} {text}" for name, text in known if text]
    return [f"disturbances at the strobe that cannot end a motion: {', '.join(each)}"] if each else []


def bears(one: dict[str, Any]) -> str:
    """The largest harmless disturbance of an attractor, as a displacement or a velocity; empty where the picture does not show it."""
    room = one.get("integrity")
    if room is None or room["displacement"] is None:
        return ""
    words, radius = ("at least ", room) if room["limited_by_picture"] else ("", room)
    if not words and room["displacement"] < room["resolution"]["displacement"]:
        words, radius = "less than ", room["resolution"]
    return f"{words}{1e3 * radius['displacement']:.2g} mm or {radius['velocity']:.2g} m/s"


def _one_colour(one: dict[str, Any], places: list[Place]) -> str:
    lead = f"one colour: every initial state ends in {one['name']}"
    if not places:
        return (
            f"{lead}, and a search over gaps and frequencies from 0.71 to 1.41 times these saw no other periodic motion; "
            "try wider ranges of initial states"
        )
    units = {"gap": ("--gap", "m"), "frequency_hz": ("--frequency", "Hz")}
    tips = [f"{units[place.setting][0]} {place.value:.4g} ({' and '.join(place.names)})" for place in places]
    return f"{lead}; several motions coexist at {', or at '.join(tips)}"


def _elsewhere(model: Model, data: xr.Dataset) -> list[Place]:
    """Near-by settings of coexistence."""
    setting = json.loads(data.attrs["settings"])
    plane = {name: np.asarray(data[name].values) for name in ("u0", "v0")}
    return coexistence(model, **plane, **setting, span=Span())


def coexistence(
    model: Model,
    *,
    u0: np.ndarray,
    v0: np.ndarray,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
) -> list[Place]:
    """The nearest gap and the nearest frequency, up to the square root of two away, at which periodic attractors are seen to coexist.

    Sixteen initial states around the given ones are integrated at each of 21 gaps (of 21 clearances up to A0 where the gap is 0) and 21
    frequencies. Motions that do not settle do not count.

    Arguments:
        model: the rig.
        u0: m; the ends matter.
        v0: m/s.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        span: how long, at first.
    """
    low, high = (np.array([f(u0), f(v0)]) for f in (np.min, np.max))
    half = _WIDER * 0.5 * (high - low)
    ends = 0.5 * (high + low) - half, 0.5 * (high + low) + half
    starts = np.stack(np.meshgrid(*np.linspace(*ends, _STARTS).T), axis=-1).reshape(-1, 2)
    tried = {"gap": gap * _FACTORS if gap > 0 else base_amplitude * np.linspace(0.05, 1.0, 21), "frequency_hz": frequency_hz * _FACTORS}
    here = {"gap": gap, "frequency_hz": frequency_hz}
    settings = [here | {name: float(value)} for name, values in tried.items() for value in values]
    gaps, frequencies = (np.array([one[name] for one in settings])[:, None] for name in here)
    rigid = isinstance(model.law, AbstractInstantaneousLaw)
    u = np.minimum(starts[None, :, 0], gaps) if rigid else starts[None, :, 0]
    values = {"u0": u, "v0": starts[None, :, 1], "gap": gaps, "frequency_hz": frequencies, "base_amplitude": base_amplitude}
    points = Points(coords={"setting": np.arange(float(len(settings))), "start": np.arange(float(len(starts)))}, values=values)
    found, kind, growth = settled(model, points, span=span, most_cycles=0, lyapunov_cycles=0)
    places = []
    for number, setting in enumerate(settings):
        name = "gap" if number < len(tried["gap"]) else "frequency_hz"
        scale = scales(np.asarray(base_amplitude), np.asarray(setting["frequency_hz"]))
        section = np.stack([found.u[number], found.v[number]], axis=-1) / scale
        _, each = attractors(Sections(section, kind.kind[number], kind.impacts[number], kind.period[number], growth[number]))
        names = tuple(one.name for one in each if one.period > 0)
        if len(names) > 1:
            places.append(Place(name, setting[name], names))
    return [best for name in here if (best := _nearest([place for place in places if place.setting == name], here[name])) is not None]


def _nearest(places: list[Place], here: float) -> Place | None:
    return min(places, key=lambda place: abs(place.value - here)) if places else None
