"""Section points and forces along the swept parameter."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import SKY, new_figure
from vibrojax.studies.figures.base import add_ratio_axis, label, setting
from vibrojax.symbols import AT_STROBES, FORCE_OF_CYCLE

DOWN = "#8c2d04"
"""Dark on the pale blue of the sweep up: they differ in grey too."""


def draw(data: xr.Dataset) -> Figure:
    """Displacement at the strobes above, largest force of each cycle below; up pale and down dark, jumps as broken lines."""
    parameter = setting(data, "parameter")
    figure = new_figure(5.4, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    x = data[parameter].values
    for direction, colour, size, dash in (("up", SKY, 3.6, "--"), ("down", DOWN, 1.6, ":")):
        part = data.sel(direction=direction)
        for axes, name, scale in ((top, "displacement", 1e3), (bottom, "impact_force", 1.0)):
            points = scale * part[name].values
            axes.plot(np.repeat(x, points.shape[1]), points.ravel(), ".", color=colour, ms=size, mew=0, rasterized=True)
        jumps = x[part["jump"].values == 1]
        for place in jumps:
            top.axvline(place, color=colour, lw=0.8, ls=dash, zorder=0)
        count = "1 jump" if jumps.size == 1 else f"{jumps.size} jumps"
        top.plot([], [], ".", color=colour, ms=6, mew=0, label=f"{direction}, {count}")
    top.set_ylabel(AT_STROBES)
    bottom.set_ylabel(FORCE_OF_CYCLE)
    bottom.set_xlabel(label(data, parameter))
    add_ratio_axis(top, data, parameter)
    top.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0) if parameter != "frequency_hz" else None)
    return figure
