"""The map of z, and the force where z = 1/1."""

import json

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.figure_style import FORCE_OVER_WEIGHT
from vibrojax.studies.base import CHAOS
from vibrojax.studies.classify import APERIODIC, FAILED, NO_IMPACT, PERIODIC
from vibrojax.studies.figures import regions
from vibrojax.studies.figures.base import label
from vibrojax.studies.figures.regions import Region, colours_of, draw_regions

_MOST = 6
_BORDER = "#d7191c"


def draw(data: xr.Dataset) -> Figure:
    """z = p/q by colour (the most frequent ones by name), chaos black, unsettled grey, no impact white; and force on z = 1/1.

    Borders (`studies.peterka.with_borders`) are lines over it, those of grazings broken.
    """
    figure = new_figure(4.2, 9.6, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    x, y = data["ratio"].values, data["clearance"].values
    patches = draw_regions(left, x, y, regions_of(data))
    limits = left.get_xlim(), left.get_ylim()
    figure.legend(handles=patches, loc="outside lower center", ncols=6)
    for line in json.loads(data.attrs.get("borders", "[]")):
        left.plot(line["ratio"], line["clearance"], color=_BORDER, linewidth=1.2, linestyle="--" if "grazing" in line["kind"] else "-")
    kind, p, q = (data[name].values for name in ("kind", "impacts", "period"))
    force = np.where((kind == PERIODIC) & (p == 1) & (q == 1), data["force_over_weight"].values, np.nan)
    if np.isfinite(force).any():
        shown = right.pcolormesh(x, y, np.ma.masked_invalid(force), cmap="viridis", shading="nearest", rasterized=True)
        figure.colorbar(shown, ax=right, label=f"{FORCE_OVER_WEIGHT} on z = 1/1")
    left.set(xlim=limits[0], ylim=limits[1])
    right.set(xlim=limits[0], ylim=limits[1])
    for axes in (left, right):
        axes.set_xlabel(label(data, "ratio"))
        axes.grid(False)
    left.set_ylabel(label(data, "clearance"))
    return figure


def regions_of(data: xr.Dataset) -> list[Region]:
    """The regions of a map; those of z = p/q by how often they occur, and kinds of motion that do not occur are left out."""
    kind, p, q = (data[name].values for name in ("kind", "impacts", "period"))
    codes = np.where(kind == PERIODIC, 1000 * p + q, 0)
    found, counts = np.unique(codes[codes > 0], return_counts=True)
    motions = [(int(code) // 1000, int(code) % 1000) for code in found[np.argsort(-counts)][:_MOST]]
    named = [
        Region(name=f"z = {a}/{b}", colour=colour, cells=codes == 1000 * a + b, inside=f"{a}/{b}")
        for (a, b), colour in zip(motions, colours_of(motions), strict=True)
    ]
    chaotic = (kind == APERIODIC) & (np.nan_to_num(data["lyapunov"].values, nan=0.0) > CHAOS)
    others = [
        Region(
            name="other z",
            colour=regions.OTHER,
            cells=(kind == PERIODIC) & ~np.isin(codes, [1000 * a + b for a, b in motions]),
        ),
        Region(name="chaos", colour=regions.CHAOS, cells=chaotic),
        Region(name="not settled, or q > 8", colour=regions.UNSETTLED, cells=(kind == APERIODIC) & ~chaotic),
        Region(name="not integrated", colour=regions.NOT_INTEGRATED, cells=kind == FAILED),
    ]
    none = Region(name="no impact", colour=regions.NO_IMPACT, cells=kind == NO_IMPACT)
    return [none, *named, *(region for region in others if region.cells.any())]
