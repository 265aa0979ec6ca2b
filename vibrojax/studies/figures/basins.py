"""Basins in the plane of initial states."""

import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrojax.drawing import COLOURS, new_figure


def draw(data: xr.Dataset) -> Figure:
    """Initial states that keep impacting, and those that do not."""
    figure = new_figure(4.4, layout="constrained")
    axes = figure.subplots()
    colours = ["#ff00ff", "#ffffff", COLOURS[0]]
    shown = ListedColormap(colours)
    plane = 1e3 * data["u0"], data["v0"], data["impacting"]
    axes.pcolormesh(*plane, cmap=shown, vmin=-1.5, vmax=1.5, shading="nearest", rasterized=True)
    axes.set(xlabel="initial displacement relative to the cart (mm)", ylabel="initial velocity (m/s)")
    axes.grid(False)
    share = 100 * data.attrs["basin_measure"]
    names = [(COLOURS[0], f"keeps impacting: {share:.1f} %"), ("#ffffff", f"no impact: {100 - share:.1f} %")]
    figure.legend(handles=[Patch(facecolor=c, edgecolor="#808080", label=text) for c, text in names], loc="outside lower center", ncols=2)
    return figure
