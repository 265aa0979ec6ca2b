"""What a study found, in one sentence for the terminal and the caption; of basins of one colour, where else to look."""

import itertools
import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.model import Model
from vibrojax.studies import coexistence
from vibrojax.studies.attractors import Place, places_of_coexistence
from vibrojax.studies.base import APERIODIC, CHAOS, FAILED, LONGEST, PERIODIC, setting

_LISTED = 5
"""Attractors that are named one by one."""


def with_finding(model: Model, data: xr.Dataset) -> xr.Dataset:
    """The study with its attribute `finding`.

    Arguments:
        model: the rig.
        data: as `basins` returns it.
    """
    places = []
    if len(json.loads(data.attrs["attractors"])) == 1:
        plane = {name: np.asarray(data[name].values) for name in ("u0", "v0")}
        places = places_of_coexistence(model, **plane, **json.loads(data.attrs["settings"]))
    return data.assign_attrs(finding=basins_finding(data, places))


def document(data: xr.Dataset) -> str:
    """What a study of basins found, without its picture, as JSON."""
    numbers = {name: value if math.isfinite(value) else None for name, value in data.attrs.items() if isinstance(value, float)}
    numbers.pop("seconds", None)
    found = {"finding": data.attrs.get("finding", ""), "settings": json.loads(data.attrs["settings"])}
    found |= {"manifolds": json.loads(data.attrs["manifolds"])} if "manifolds" in data.attrs else {}
    return json.dumps(found | numbers | {"attractors": json.loads(data.attrs["attractors"])}, indent=1, allow_nan=False) + "\n"


def basins_finding(data: xr.Dataset, places: list[Place]) -> str:
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
    known = [(one["name"], bears(one)) for one in rows[:_LISTED]]
    each = [f"{name} {text}" for name, text in known if text]  # those whose section points lie in the picture
    room = [f"disturbances at the strobe that cannot end a motion: {', '.join(each)}"] if each else []
    return "; ".join([lead, *_border(data), *room])


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


_RUNS, _JUMPS = 3, 4
"""Most stretches along an axis, and jumps, that a sentence names."""


def finding(name: str, data: xr.Dataset) -> str:
    """The sentence of a study, or of its quantiles over draws.

    Arguments:
        name: of the command.
        data: its data set.
    """
    return (_OF_DRAWS if "quantile" in data.dims else _OF_STUDY)[name](data)


def bands(x: np.ndarray, kind: np.ndarray, impacts: np.ndarray, period: np.ndarray, unit: str) -> str:
    """The longest bands of one motion along an axis, in the order in which they lie.

    Example:
        >>> bands(np.arange(5.0), np.array([0, 1, 1, 1, 0]), np.array([0, 1, 1, 1, 0]), np.array([0, 2, 2, 2, 0]), "Hz")
        'z = 1/2 from 1 to 3 Hz'
    """
    aperiodic = f"no period up to {LONGEST} cycles"
    names = [
        f"z = {p}/{q}" if which == PERIODIC else aperiodic if which == APERIODIC else ""
        for which, p, q in zip(kind.tolist(), impacts.tolist(), period.tolist(), strict=True)
    ]
    longest, _ = _longest_runs(names, [name != "" for name in names])
    return ", ".join(f"{names[a]} {_from_to(x, a, b, unit)}" for a, b in longest) or "no motion with impacts"


def _longest_runs(labels: Sequence[Any], counted: Sequence[bool]) -> tuple[list[tuple[int, int]], int]:
    """First and last place of the longest runs of equal labels that count, in the order in which they lie; and how many more there are."""
    starts = [0, *(i for i in range(1, len(labels)) if labels[i] != labels[i - 1]), len(labels)]
    runs = [(a, b - 1) for a, b in itertools.pairwise(starts) if counted[a]]
    return sorted(sorted(runs, key=lambda run: run[0] - run[1])[:_RUNS]), max(len(runs) - _RUNS, 0)


def _from_to(x: np.ndarray, first: int, last: int, unit: str) -> str:
    return (f"from {x[first]:.4g} to {x[last]:.4g} {unit}" if last > first else f"at {x[first]:.4g} {unit}").rstrip()


def _coexisting(data: xr.Dataset, x: np.ndarray, unit: str) -> str:
    """Where several motions exist along the only axis of a study, rest named first; `x` along it, as it is printed."""
    others = data["other_code"].values.reshape(-1, data.sizes["other"])
    each = [
        [coexistence.name(of) for of in sorted(mine | {int(of) for of in other if of >= 0})]
        for mine, other in zip(coexistence.own_motions(data), others, strict=True)
    ]
    longest, more = _longest_runs(each, [len(names) > 1 for names in each])
    places = [f"{_listed(each[a])} coexist {_from_to(x, a, b, unit)}" for a, b in longest]
    rest = f", and others in {more} more stretch{'' if more == 1 else 'es'}" if more else ""
    return (", ".join(places) or "no motions that coexist") + rest


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]])


def _how(data: xr.Dataset) -> str:
    """How the motions beside those of a study were looked for."""
    said = json.loads(data.attrs["coexistence"])
    where = f" at each of {said['asked']} of {said['points']} points" if said["points"] > 1 else ""
    followed = "up and down" if said["followed"] is True else said["followed"]
    return f" ({said['starts']} starts{where}{f', each motion followed {followed}' if followed else ''})"


def _curves(data: xr.Dataset, *, along: str, unit: str, name: str = "") -> str:
    """Bands, and where the force is largest, for every curve."""
    others = [dim for dim in data["impact_force"].dims if dim != along]
    found = []
    for part in _each(data, others):
        x, force = part[along].values, np.where(part["kind"].values == FAILED, np.nan, part["impact_force"].values)
        words = bands(x, part["kind"].values, part["impacts"].values, part["period"].values, unit)
        if np.nanmax(force, initial=0.0) > 0:
            top = int(np.nanargmax(force))
            words += f", largest F_i {force[top]:.3g} N at {name}{x[top]:.4g} {unit}".rstrip()
        if "coexistence" in data.attrs:
            words += f"; {_beside(part, x, force, along, unit)}"
        found.append(f"{_where(part, others)}: {words}")
    return "; ".join(found) + (_how(data) if "coexistence" in data.attrs else "")


def _beside(part: xr.Dataset, x: np.ndarray, force: np.ndarray, along: str, unit: str) -> str:
    """Which motions coexist, and the largest force of those that rest does not lead to, where it is larger."""
    found = _coexisting(part, x, unit)
    other = np.nan_to_num(part["other_force"].max("other").values, nan=0.0)
    if other.max(initial=0.0) <= np.nanmax(force, initial=0.0):
        return found
    top = int(np.argmax(other))
    which = int(part["other_code"].values[top][np.nanargmax(part["other_force"].values[top])])
    return f"{found}, largest F_i of them {other[top]:.3g} N on {coexistence.name(which)} at {x[top]:.4g} {unit}".rstrip()


def _bifurcation(data: xr.Dataset) -> str:
    parameter = setting(data, "parameter")
    scale, unit = _unit(data, parameter)
    found = []
    for direction in ("up", "down"):
        part = data.sel(direction=direction)
        x, period = scale * part[parameter].values, part["period"].values
        impacts = coexistence.impacts_in_period(part).values
        places = [f"{place:.4g}" for place in x[part["jump"].values == 1]][:: 1 if direction == "up" else -1]
        more = f" and {len(places) - _JUMPS} more" if len(places) > _JUMPS else ""
        jumps = f", jump at {', '.join(places[:_JUMPS])} {unit}{more}" if places else ", no jump"
        found.append(f"{direction}wards: {bands(x, part['kind'].values, impacts, period, unit)}{jumps}")
    if "coexistence" in data.attrs:
        found.append(_coexisting(data, scale * data[parameter].values, unit) + _how(data))
    return "; ".join(found)


def _peterka(data: xr.Dataset) -> str:
    from vibrojax.studies.figures.maps import regions_of

    shares = [(float(region.cells.mean()), region.name) for region in regions_of(data)]
    found = "of the map: " + ", ".join(f"{name} {100 * share:.1f} %" for share, name in sorted(shares, reverse=True))
    if "coexistence" not in data.attrs:
        return found
    continued = coexistence.is_continued(data)
    asked = np.ones(data["kind"].shape, bool) if continued else data["asked"].transpose("clearance", "ratio").values == 1
    several = coexistence.several_in_map(data) & asked
    sets, counts = np.unique(np.sort(coexistence.codes_of_map(data)[several], axis=-1), axis=0, return_counts=True)
    most = f", {_listed([coexistence.name(int(of)) for of in sets[np.argmax(counts)] if of >= 0])} most often" if counts.size else ""
    where = f"in {100 * several.mean():.1f} % of it" if continued else f"at {several.sum()} of the {asked.sum()} cells that were asked"
    return f"{found}; several motions coexist {where}{most}{_how(data)}"


def _section(data: xr.Dataset) -> str:
    period = coexistence.section_period(data)
    if not data["touches"].values[-LONGEST:].any():
        return f"at {setting(data, 'frequency_hz'):g} Hz no impact{_beside_section(data)}"
    cycles = "cycle" if period == 1 else f"{period} cycles"
    words = f"the motion repeats every {cycles}" if period else f"the motion does not repeat within {LONGEST} cycles"
    return f"at {setting(data, 'frequency_hz'):g} Hz {words}, largest F_i {float(data['peak_force'].max()):.3g} N{_beside_section(data)}"


def _beside_section(data: xr.Dataset) -> str:
    """What exists beside the motion of a section, with the force of each."""
    if "coexistence" not in data.attrs:
        return ""
    others = [
        f"{coexistence.name(int(of))}{f' ({force:.3g} N)' if of else ''}"
        for of, force in zip(data["other_code"].values, data["other_force"].values, strict=True)
        if of >= 0
    ]
    found = f"{' and '.join(others)} {'exists' if len(others) == 1 else 'exist'} beside it" if others else "no other motion found"
    return f"; {found}{_how(data)}"


def _basins(data: xr.Dataset) -> str:
    return str(data.attrs["finding"]) if "finding" in data.attrs else basins_finding(data, [])


def _lyapunov(data: xr.Dataset) -> str:
    parameter = setting(data, "parameter")
    scale, unit = _unit(data, parameter)
    x, exponent = scale * data[parameter].values, np.nan_to_num(data["exponent"].values, nan=-np.inf)
    top = int(np.argmax(exponent))
    largest = f"largest exponent {exponent[top]:.3g} per cycle at {x[top]:.4g} {unit}"
    chaotic = (exponent > CHAOS).astype(int)
    share = f"chaos at {chaotic.sum()} of {chaotic.size} values" if chaotic.any() else "no chaos"
    return f"{share}, {largest}"


def _curves_of_draws(data: xr.Dataset, *, along: str, unit: str, name: str = "") -> str:
    """Where the median force is largest, for every curve."""
    others = [dim for dim in data["impact_force"].dims if dim not in (along, "quantile")]
    words = []
    for part in _each(data, others):
        force = part["impact_force"].transpose("quantile", along).values
        top = int(np.nanargmax(np.nan_to_num(force[2], nan=-1.0)))
        words.append(
            f"{_where(part, others)}: largest median F_i {force[2, top]:.3g} N (95 %: {force[0, top]:.3g} to {force[4, top]:.3g} N) "
            f"at {name}{float(part[along][top]):.4g} {unit}".rstrip()
        )
    return "; ".join(words)


def _most_likely(data: xr.Dataset, *, name: str, what: str) -> str:
    """Where a kind of motion has its largest probability."""
    share = data[name].fillna(0.0)
    place = share.stack(all=share.dims).isel(all=int(np.argmax(share.values)))
    return f"{what} is likeliest, {100 * float(place):.0f} %, at {_where(place, [dim for dim in share.dims if dim != 'direction'])}"


def _basins_of_draws(data: xr.Dataset) -> str:
    low, middle, high = (100 * float(data["basin_measure"].isel(quantile=i)) for i in (0, 2, 4))
    return f"{middle:.1f} % (95 %: {low:.1f} to {high:.1f} %) of the initial states keep impacting"


def _section_of_draws(data: xr.Dataset) -> str:
    force = data["impact_force"].transpose("quantile", "time").values
    return f"largest median F_i {np.nanmax(force[2]):.3g} N, largest of the upper 97.5 % {np.nanmax(force[4]):.3g} N"


def _each(data: xr.Dataset, dims: Sequence[Any]) -> list[xr.Dataset]:
    """The study at every combination of values on some axes."""
    if not dims:
        return [data]
    stacked = data.stack(one=list(dims))
    return [stacked.isel(one=number) for number in range(stacked.sizes["one"])]


def _where(part: Any, dims: Sequence[Any]) -> str:
    """Values on some axes, with their units."""
    found = []
    for dim in dims:
        scale, unit = _unit(part, str(dim))
        found.append(f"{str(dim).removesuffix('_hz')} {scale * float(part[dim]):.4g} {unit}".rstrip())
    return ", ".join(found)


def _unit(data: Any, name: str) -> tuple[float, str]:
    """Factor and unit for print: lengths of a gap in mm."""
    unit = data[name].attrs.get("units", {"gap": "m", "frequency_hz": "Hz"}.get(name, "1"))
    return (1e3, "mm") if unit == "m" else (1.0, "" if unit == "1" else unit)


_OF_STUDY: dict[str, Callable[[xr.Dataset], str]] = {
    "response": partial(_curves, along="frequency_hz", unit="Hz"),
    "bifurcation": _bifurcation,
    "peterka": _peterka,
    "section": _section,
    "basins": _basins,
    "basins_along": _basins,
    "lyapunov": _lyapunov,
    "design": partial(_curves, along="mass_ratio", unit="", name="mass ratio "),
}
_OF_DRAWS: dict[str, Callable[[xr.Dataset], str]] = {
    "response": partial(_curves_of_draws, along="frequency_hz", unit="Hz"),
    "bifurcation": partial(_most_likely, name="probability_jump", what="a jump"),
    "peterka": partial(_most_likely, name="probability_1_1", what="z = 1/1"),
    "section": _section_of_draws,
    "basins": _basins_of_draws,
    "lyapunov": partial(_most_likely, name="probability_chaos", what="chaos"),
    "design": partial(_curves_of_draws, along="mass_ratio", unit="", name="mass ratio "),
}
