"""Basins in the plane of initial states, and shares of the attractors along a parameter."""

import json
import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Patch

from vibrojax.drawing import AMBER, BLUE, GREEN, ORANGE, PINK, SKY, new_figure
from vibrojax.studies.figures.base import label, setting

WHITE, BLACK, GREY, _EDGE = "#ffffff", "#202020", "#9a9a9a", "#606060"
_STABLE, _UNSTABLE = "#d7191c", "#6a3d9a"
_FAILED, _OTHERS = "#ff00ff", "#c6dbef"
_STRIKING = (BLUE, AMBER, GREEN, PINK, SKY, ORANGE)
_QUIET = (WHITE, "#dcdcdc", "#bdbdbd")


def draw(data: xr.Dataset) -> Figure:
    """Each basin in the colour of its attractor, whose section points are marked; discs that lie within a basin around them.

    Manifolds of saddles (`basin_manifolds.with_manifolds`) are lines over it.
    """
    rows = json.loads(data.attrs["attractors"])
    colours = colours_of([(one["impacts"], one["period"], one["name"]) for one in rows])
    figure = new_figure(4.8, layout="constrained")
    axes = figure.subplots()
    plane = 1e3 * data["u0"], data["v0"], data["attractor"].transpose("v0", "u0")
    shown = ListedColormap([_FAILED, *colours])
    axes.pcolormesh(*plane, cmap=shown, vmin=-1.5, vmax=len(colours) - 0.5, shading="nearest", rasterized=True)
    limits = axes.get_xlim(), axes.get_ylim()
    for one, colour in zip(rows, colours, strict=True):
        _mark(axes, one, colour, 2.0 * math.pi * setting(data, "frequency_hz"))
    if "manifold_u" in data:
        _draw_manifolds(axes, data)
    axes.set(xlabel="initial displacement relative to the cart (mm)", ylabel="initial velocity (m/s)", xlim=limits[0], ylim=limits[1])
    axes.grid(False)
    axes.set_title(_title(data), loc="left", fontsize=8)
    patches = [
        Patch(facecolor=colour, edgecolor="#808080", label=f"{one['name']}: {100 * one['share']:.1f} %")
        for one, colour in zip(rows, colours, strict=True)
    ]
    if bool((data["attractor"] < 0).any()):
        patches.append(Patch(facecolor=_FAILED, label="not integrated"))
    figure.legend(handles=patches[:_MOST], loc="outside lower center", ncols=min(3, max(len(patches[:_MOST]), 1)))
    return figure


def _draw_manifolds(axes: Axes, data: xr.Dataset) -> None:
    """Stable manifolds full, unstable ones thin, and the section points of the saddles."""
    u, v, stable = 1e3 * data["manifold_u"].values, data["manifold_v"].values, data["manifold_stable"].values == 1
    for chosen, colour, width in ((~stable, _UNSTABLE, 0.5), (stable, _STABLE, 0.9)):
        axes.plot(np.where(chosen, u, np.nan), np.where(chosen, v, np.nan), color=colour, linewidth=width)
    for one in json.loads(data.attrs["manifolds"])["saddles"]:
        axes.plot(1e3 * np.array(one["section"]["u"]), one["section"]["v"], "X", mfc=_STABLE, mec="#ffffff", mew=0.6, ms=6)


_MOST = 12
"""Entries of the legend."""


def colours_of(motions: list[tuple[int, int, str]]) -> list[str]:
    """A colour for each attractor (p, q, name): no impact white and pale greys, chaos black, unsettled grey, the rest in colour.

    Example:
        >>> colours_of([(0, 1, "no impact"), (1, 1, "z = 1/1"), (0, 0, "chaotic")])
        ['#ffffff', '#0072b2', '#202020']
    """
    found, counts = [], {"quiet": 0, "striking": 0}
    for impacts, period, name in motions:
        if period == 0:
            found.append(BLACK if name.startswith("chaotic") else GREY)
            continue
        kind, palette = ("quiet", _QUIET) if impacts == 0 else ("striking", _STRIKING)
        found.append(palette[counts[kind]] if counts[kind] < len(palette) else _OTHERS)
        counts[kind] += 1
    return found


def _mark(axes: Axes, one: dict[str, Any], colour: str, omega: float) -> None:
    """Section points of an attractor, and the largest disc around each of them that lies in its basin."""
    u, v = ([scale * value for value in one["section"][name]] for name, scale in (("u", 1e3), ("v", 1.0)))
    size = 5 if one["period"] else 2
    axes.plot(u, v, "o", mfc=colour if one["period"] else "#ffffff", mec="#000000", mew=0.8 if one["period"] else 0.2, ms=size)
    radius = one.get("integrity", {}).get("displacement")
    if radius and one["period"]:
        for place in zip(u, v, strict=True):
            axes.add_patch(Ellipse(place, 2e3 * radius, 2.0 * radius * omega, fill=False, ec="#000000", lw=0.8, ls="--"))


def _title(data: xr.Dataset) -> str:
    """The numbers of the boundary."""
    numbers = {name: float(data.attrs.get(name, math.nan)) for name in _NUMBERS}
    if not math.isfinite(numbers["boundary_dimension"]):
        return ""
    entropy, border, dimension, error = numbers.values()
    return f"basin entropy {entropy:.2f}, of the boundary {border:.2f}\ndimension of the boundary {dimension:.2f} ± {error:.2f}"


_NUMBERS = ("basin_entropy", "boundary_basin_entropy", "boundary_dimension", "uncertainty_exponent_stderr")


def draw_along(data: xr.Dataset) -> Figure:
    """A band for each attractor, as high as its share of the initial states, in the order in which they appear."""
    parameter = setting(data, "parameter")
    table = json.loads(data.attrs["attractors"])
    shares = np.nan_to_num(data["share"].values)
    p, q = data["attractor_impacts"].values, data["attractor_period"].values
    best = shares.argmax(axis=0)
    motions = [
        (int(p[place, number]), int(q[place, number]), _motion(one)) for number, (place, one) in enumerate(zip(best, table, strict=True))
    ]
    figure = new_figure(3.8, layout="constrained")
    axes = figure.subplots()
    values = data[parameter].values
    names = [" then ".join(list(dict.fromkeys(one["motions"]))[:3]) for one in table]
    axes.stackplot(values, *(100 * shares.T), colors=colours_of(motions), labels=names, edgecolor=_EDGE, lw=0.4, step="mid")
    axes.set(xlabel=label(data, parameter), ylabel="share of the initial states (%)", ylim=(0, 100), xlim=(values[0], values[-1]))
    axes.grid(False)
    figure.legend(loc="outside lower center", ncols=3, handlelength=1.2)
    return figure


def _motion(one: dict) -> str:
    """What an attractor is for most of its way."""
    return max(one["motions"], key=one["motions"].count)
