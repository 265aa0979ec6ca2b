"""Figures of the studies over a plane: Peterka map, basins of attraction, and the shares of basins along a parameter."""

import dataclasses
import json
import math
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Bool
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch
from matplotlib.patheffects import withStroke
from scipy.ndimage import distance_transform_edt
from scipy.ndimage import label as connected

from vibrojax.drawing import AMBER, BLUE, GREEN, GREY, ORANGE, PINK, SKY, new_figure
from vibrojax.figure_style import FORCE_OVER_WEIGHT
from vibrojax.studies.base import APERIODIC, CHAOS, FAILED, GRAVITY, NO_IMPACT, code, codes, setting
from vibrojax.studies.coexistence import is_continued, several_in_map
from vibrojax.studies.figures.lines import label

COLOUR_NO_IMPACT, COLOUR_OTHER = "#ffffff", "#dfe9f4"
COLOUR_UNSETTLED, COLOUR_CHAOS, COLOUR_NOT_INTEGRATED = "#2f2f2f", "#000000", "#661a86"
_USUAL = {(1, 1): "#0058b0", (1, 2): "#efd139", (1, 3): "#ec7bb4", (2, 2): "#6bc3ef", (1, 4): "#1d9f5e", (2, 1): "#bd4804"}
"""Colour of z = p/q in every map, so that maps compare; in lightness from 38 to 84, some 9 apart."""
_LEAST = 0.05
"""Of the shorter side of a map: a region whose inscribed circle has this radius has room for its name."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Region:
    """One region: its name, colour, cells, and what is written inside; empty for nothing."""

    name: str
    colour: str
    cells: Bool[np.ndarray, "y x"]
    inside: str = ""


def motion_colours(motions: list[tuple[int, int]]) -> list[str]:
    """A colour for each z = p/q, at most six; one that is usual has its own, others take what is free.

    Example:
        >>> motion_colours([(3, 2), (1, 1)])
        ['#efd139', '#0058b0']
    """
    free = [colour for motion, colour in _USUAL.items() if motion not in motions]
    return [_USUAL[motion] if motion in _USUAL else free.pop(0) for motion in motions]


def draw_regions(axes: Axes, x: np.ndarray, y: np.ndarray, regions: list[Region]) -> list[Patch]:
    """Paint a map's regions, write names where there is room, and return the patches of its legend."""
    picture = np.zeros(regions[0].cells.shape, dtype=int)
    for number, region in enumerate(regions):
        picture[region.cells] = number
    colours = ListedColormap([region.colour for region in regions])
    axes.pcolormesh(x, y, picture, cmap=colours, vmin=-0.5, vmax=len(regions) - 0.5, shading="nearest", rasterized=True)
    for region in regions:
        if region.inside and (place := _middle(region.cells)):
            pale = lightness(region.colour) > 60
            text = axes.text(x[place[1]], y[place[0]], region.inside, ha="center", va="center", color="black" if pale else "white")
            text.set_path_effects([withStroke(linewidth=1.5, foreground=region.colour)])
    return [Patch(facecolor=region.colour, edgecolor=GREY, lw=0.5, label=region.name) for region in regions]


def lightness(colour: str) -> float:
    """CIE L* of a colour, 0 black to 100 white: what is left of it in grey.

    Example:
        >>> lightness("#ffffff"), lightness("#000000")
        (100.0, 0.0)
    """
    linear = np.array([c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)])
    luminance = float(linear @ [0.2126, 0.7152, 0.0722])
    return round(116.0 * float(np.cbrt(luminance)) - 16.0 if luminance > 0.008856 else 903.3 * luminance, 1)


def _middle(cells: np.ndarray) -> tuple[int, int] | None:
    """The cell of the largest connected part that lies farthest from its border; None where a name has no room."""
    found: Any = connected(cells)
    parts, count = found
    if count == 0:
        return None
    largest = parts == 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    depth = np.asarray(distance_transform_edt(np.pad(largest, 1)))[1:-1, 1:-1]
    if depth.max() < _LEAST * min(cells.shape):
        return None
    row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return int(row), int(column)


_MOST_NAMED = 6
_BORDER = "#d7191c"
_HATCH, _HATCHED = "....", "#606060"


def draw_peterka(data: xr.Dataset) -> Figure:
    """z = p/q by colour (the most frequent ones by name), chaos black, unsettled grey, no impact white; and force on z = 1/1.

    Borders (`continuation_lines.with_borders`) are lines over it, those of grazings broken. Hatched is where several motions exist, or
    rings mark the cells at which they were found (`coexistence.of_map`). The force is that of z = 1/1 wherever it is known to exist.
    """
    figure = new_figure(4.2, 9.6, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    x, y = data["ratio"].values, data["clearance"].values
    patches: list[Artist] = [*draw_regions(left, x, y, regions_of(data))]
    draw_values(right, x, y, _on_first(data), f"{FORCE_OVER_WEIGHT} on z = 1/1")
    finish_map(left, right, data)
    for line in json.loads(data.attrs.get("borders", "[]")):
        left.plot(line["ratio"], line["clearance"], color=_BORDER, linewidth=1.2, linestyle="--" if "grazing" in line["kind"] else "-")
    if "coexistence" in data.attrs:
        patches.append(_draw_several(left, data))
    figure.legend(handles=patches, loc="outside lower center", ncols=6)
    return figure


def draw_values(axes: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray, text: str, **shades: Any) -> None:
    """Paint values over a plane, and their bar beside it; nothing where none is finite.

    Arguments:
        axes: the panel.
        x: values along it.
        y: the same.
        values: NaN where there is none, `(y, x)`.
        text: what the bar is called.
        shades: as for `pcolormesh`; the colour map is "viridis" unless given.
    """
    if np.isfinite(values).any():
        how: dict[str, Any] = {"cmap": "viridis", "shading": "nearest", "rasterized": True} | shades
        axes.figure.colorbar(axes.pcolormesh(x, y, np.ma.masked_invalid(values), **how), ax=axes, label=text)


def finish_map(left: Axes, right: Axes, data: xr.Dataset) -> None:
    """Names of the axes of a Peterka map, which end where its left panel does; what is drawn over it later does not widen them."""
    limits = left.get_xlim(), left.get_ylim()
    for axes in (left, right):
        axes.set(xlabel=label(data, "ratio"), xlim=limits[0], ylim=limits[1])
        axes.grid(False)
    left.set_ylabel(label(data, "clearance"))


def _draw_several(axes: Axes, data: xr.Dataset) -> Artist:
    """Where several motions exist, and what the legend says of it."""
    x, y, several = data["ratio"].values, data["clearance"].values, several_in_map(data)
    if is_continued(data) and min(several.shape) > 1:
        axes.contourf(x, y, several.astype(float), levels=[0.5, 1.5], colors="none", hatches=[_HATCH])
        return Patch(facecolor="#ffffff", edgecolor=_HATCHED, hatch=_HATCH, lw=0.5, label="another motion, too")
    row, column = np.nonzero(several & (is_continued(data) | (data["asked"].transpose("clearance", "ratio").values == 1)))
    rings: dict[str, Any] = dict(marker="o", mfc="#ffffff", mec="#000000", mew=0.5, ms=2.5, ls="none")
    axes.plot(x[column], y[row], **rings)
    return Line2D([], [], label="another motion, too", **rings)


def _on_first(data: xr.Dataset) -> np.ndarray:
    """Force over weight on z = 1/1, the cell's own motion or one beside it; NaN where it is not known."""
    *motion, over_weight = (
        data[name].transpose("clearance", "ratio").values for name in ("kind", "impacts", "period", "force_over_weight")
    )
    own = np.where(codes(*motion) == code(1, 1), over_weight, np.nan)
    if "other_code" not in data:
        return own
    weight = GRAVITY * json.loads(data.attrs["model"])["mass"]
    beside = data["other_force"].where(data["other_code"] == code(1, 1)).transpose("clearance", "ratio", "other").values / weight
    return np.fmax(own, np.fmax.reduce(beside, axis=-1))


def regions_of(data: xr.Dataset) -> list[Region]:
    """The regions of a map; those of z = p/q by how often they occur, and kinds of motion that do not occur are left out."""
    kind, p, q = (data[name].values for name in ("kind", "impacts", "period"))
    each = codes(kind, p, q)
    found, counts = np.unique(each[each > 0], return_counts=True)
    motions = [(int(one) // 1000, int(one) % 1000) for one in found[np.argsort(-counts)][:_MOST_NAMED]]
    named = [
        Region(name=f"z = {a}/{b}", colour=colour, cells=each == 1000 * a + b, inside=f"{a}/{b}")
        for (a, b), colour in zip(motions, motion_colours(motions), strict=True)
    ]
    chaotic = (kind == APERIODIC) & (np.nan_to_num(data["lyapunov"].values, nan=0.0) > CHAOS)
    others = [
        Region(name="other z", colour=COLOUR_OTHER, cells=(each > 0) & ~np.isin(each, [1000 * a + b for a, b in motions])),
        Region(name="chaos", colour=COLOUR_CHAOS, cells=chaotic),
        Region(name="not settled, or q > 8", colour=COLOUR_UNSETTLED, cells=(kind == APERIODIC) & ~chaotic),
        Region(name="not integrated", colour=COLOUR_NOT_INTEGRATED, cells=kind == FAILED),
    ]
    none = Region(name="no impact", colour=COLOUR_NO_IMPACT, cells=kind == NO_IMPACT)
    return [none, *named, *(region for region in others if region.cells.any())]


WHITE, BLACK, PALE = "#ffffff", "#202020", "#9a9a9a"
_STABLE, _UNSTABLE = "#d7191c", "#6a3d9a"
_FAILED, _OTHERS = "#ff00ff", "#c6dbef"
_STRIKING = (BLUE, AMBER, GREEN, PINK, SKY, ORANGE)
_QUIET = (WHITE, "#dcdcdc", "#bdbdbd")


def draw_basins(data: xr.Dataset) -> Figure:
    """Each basin in the colour of its attractor, whose section points are marked; discs that lie within a basin around them.

    Where there is but one basin, shades say how long the motion takes to settle, and the title which it is. Manifolds of saddles
    (`basin_manifolds.with_manifolds`) are lines over it.
    """
    rows = json.loads(data.attrs["attractors"])
    colours = colours_of([(one["impacts"], one["period"], one["name"]) for one in rows])
    figure = new_figure(4.8, layout="constrained")
    axes = figure.subplots()
    plane = 1e3 * data["u0"], data["v0"], data["attractor"].transpose("v0", "u0")
    if one_colour := len(rows) == 1 and not bool((data["attractor"] < 0).any()):
        cycles = data["cycles"].transpose("v0", "u0").values
        shades: dict[str, Any] = dict(cmap="cividis", vmin=cycles.min(), vmax=max(cycles.max(), cycles.min() + 1))
        draw_values(axes, 1e3 * data["u0"].values, data["v0"].values, cycles, "cycles until the orbit has closed", **shades)
    else:
        shown = ListedColormap([_FAILED, *colours])
        axes.pcolormesh(*plane, cmap=shown, vmin=-1.5, vmax=len(colours) - 0.5, shading="nearest", rasterized=True)
    limits = axes.get_xlim(), axes.get_ylim()
    for one, colour in zip(rows, colours, strict=True):
        _mark(axes, one, colour, 2.0 * math.pi * setting(data, "frequency_hz"))
    if "manifold_u" in data:
        _draw_manifolds(axes, data)
    axes.set(xlabel="initial displacement relative to the cart (mm)", ylabel="initial velocity (m/s)", xlim=limits[0], ylim=limits[1])
    axes.grid(False)
    axes.set_title(_title(data, rows[0] if one_colour else None), loc="left", fontsize=8)
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
            found.append(BLACK if name.startswith("chaotic") else PALE)
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


def _title(data: xr.Dataset, only: dict[str, Any] | None) -> str:
    """The numbers of the boundary; or the only attractor, and the speed of its impacts."""
    if only is not None:
        speed = f", impact speed {float(data['impact_speed'].median()):.3g} m/s" if only["impacts"] else ""
        return f"every start ends in {only['name']}{speed}"
    numbers = {name: float(data.attrs.get(name, math.nan)) for name in _NUMBERS}
    if not math.isfinite(numbers["boundary_dimension"]):
        return ""
    entropy, border, dimension, error = numbers.values()
    return f"basin entropy {entropy:.2f}, of the boundary {border:.2f}\ndimension of the boundary {dimension:.2f} ± {error:.2f}"


_NUMBERS = ("basin_entropy", "boundary_basin_entropy", "boundary_dimension", "uncertainty_exponent_stderr")


_FAINT = "#606060"


def draw_basins_along(data: xr.Dataset) -> Figure:
    """A band for each attractor, as high as its share of the initial states, in the order in which they appear."""
    parameter = setting(data, "parameter")
    table = json.loads(data.attrs["attractors"])
    shares = np.nan_to_num(data["share"].values)
    p, q = data["attractor_impacts"].values, data["attractor_period"].values
    best = shares.argmax(axis=0)
    mostly = [max(one["motions"], key=one["motions"].count) for one in table]
    motions = [(int(p[place, number]), int(q[place, number]), mostly[number]) for number, place in enumerate(best)]
    figure = new_figure(3.8, layout="constrained")
    axes = figure.subplots()
    values = data[parameter].values
    names = [" then ".join(list(dict.fromkeys(one["motions"]))[:3]) for one in table]
    axes.stackplot(values, *(100 * shares.T), colors=colours_of(motions), labels=names, edgecolor=_FAINT, lw=0.4, step="mid")
    axes.set(xlabel=label(data, parameter), ylabel="share of the initial states (%)", ylim=(0, 100), xlim=(values[0], values[-1]))
    axes.grid(False)
    figure.legend(loc="outside lower center", ncols=3, handlelength=1.2)
    return figure
