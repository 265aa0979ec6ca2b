"""The map of z, and the force where z = 1/1."""

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.studies.base import CHAOS
from vibrojax.studies.classify import APERIODIC, FAILED, NO_IMPACT, PERIODIC
from vibrojax.studies.figures.base import label

_MOST = 8
_EXTRA = ("#f0e442", "#8c6d31", "#7b4173", "#3b6e22")


def draw(data: xr.Dataset) -> Figure:
    """z = p/q by colour (the most frequent ones by name), chaos black, unsettled grey, no impact white; and force on z = 1/1."""
    kind, p, q = (data[name].values for name in ("kind", "impacts", "period"))
    codes = np.where(kind == PERIODIC, 1000 * p + q, 0)
    found, counts = np.unique(codes[codes > 0], return_counts=True)
    named = [int(code) for code in found[np.argsort(-counts)][:_MOST]]
    names, colours, picture = ["no impact"], ["#ffffff"], np.zeros(kind.shape, dtype=int)
    for code, colour in zip(named, COLOURS[:4] + _EXTRA, strict=False):
        names.append(f"z = {code // 1000}/{code % 1000}")
        colours.append(colour)
        picture[codes == code] = len(names) - 1
    chaotic = (kind == APERIODIC) & (np.nan_to_num(data["lyapunov"].values, nan=0.0) > CHAOS)
    others = {
        "other z": ((kind == PERIODIC) & ~np.isin(codes, named), "#c6dbef"),
        "chaos": (chaotic, "#000000"),
        "not settled, or q > 8": ((kind == APERIODIC) & ~chaotic, "#9a9a9a"),
        "not integrated": (kind == FAILED, "#ff00ff"),
    }
    for name, (where, colour) in others.items():
        if where.any():
            names.append(name)
            colours.append(colour)
            picture[where] = len(names) - 1
    picture[kind == NO_IMPACT] = 0
    return _drawn(data, picture, names, colours, (kind == PERIODIC) & (p == 1) & (q == 1))


def _drawn(data: xr.Dataset, picture: np.ndarray, names: list[str], colours: list[str], first: np.ndarray) -> Figure:
    figure = new_figure(4.2, 9.6, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    x, y = data["ratio"].values, data["clearance"].values
    options = dict(shading="nearest", rasterized=True)
    left.pcolormesh(x, y, picture, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(colours) - 0.5, **options)
    patches = [Patch(facecolor=colour, edgecolor="#808080", lw=0.5, label=name) for name, colour in zip(names, colours, strict=True)]
    figure.legend(handles=patches, loc="outside lower center", ncols=6)
    force = np.where(first, data["force_over_weight"].values, np.nan)
    shown = right.pcolormesh(x, y, np.ma.masked_invalid(force), cmap="viridis", **options)
    figure.colorbar(shown, ax=right, label="F / (m g) on z = 1/1")
    for axes in (left, right):
        axes.set_xlabel(label(data, "ratio"))
        axes.grid(False)
    left.set_ylabel(label(data, "clearance"))
    return figure
