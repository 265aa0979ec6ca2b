"""Section points and forces along the swept parameter."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.studies.figures.base import label, setting


def draw(data: xr.Dataset) -> Figure:
    """Displacement at the strobes above, largest force of each cycle below; up and down in two colours, jumps as broken lines."""
    parameter = setting(data, "parameter")
    figure = new_figure(5.4, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    x = data[parameter].values
    for direction, colour, size in (("up", COLOURS[0], 2.6), ("down", COLOURS[1], 1.2)):
        part = data.sel(direction=direction)
        for axes, name, scale in ((top, "displacement", 1e3), (bottom, "impact_force", 1.0)):
            points = scale * part[name].values
            axes.plot(np.repeat(x, points.shape[1]), points.ravel(), ".", color=colour, ms=size, mew=0, rasterized=True)
        axes_jumps = x[part["jump"].values == 1]
        for place in axes_jumps:
            top.axvline(place, color=colour, lw=0.6, ls="--", zorder=0)
        top.plot([], [], ".", color=colour, ms=6, label=f"{direction}, {axes_jumps.size} jumps")
    top.set_ylabel("displacement at the strobes (mm)")
    bottom.set_ylabel("largest force of a cycle (N)")
    bottom.set_xlabel(label(data, parameter))
    top.legend(markerscale=1.5)
    return figure
