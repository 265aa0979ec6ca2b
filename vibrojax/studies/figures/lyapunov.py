"""Lyapunov exponent below the section points it belongs to."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.studies.figures.base import label, setting


def draw(data: xr.Dataset) -> Figure:
    """Section points above, exponent below; zero as a line."""
    parameter = setting(data, "parameter")
    figure = new_figure(4.8, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    x, points = data[parameter].values, 1e3 * data["displacement"].values
    top.plot(np.repeat(x, points.shape[1]), points.ravel(), ".", color=COLOURS[0], ms=2, mew=0, rasterized=True)
    top.set_ylabel("displacement at the strobes (mm)")
    bottom.plot(x, data["exponent"], color=COLOURS[1])
    bottom.axhline(0.0, color="#606060", lw=0.8)
    bottom.set(xlabel=label(data, parameter), ylabel="exponent per cycle")
    return figure
