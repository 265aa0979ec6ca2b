"""Lyapunov exponent below the section points it belongs to."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import GREY, ORANGE, SKY, new_figure
from vibrojax.figure_style import AT_STROBES
from vibrojax.studies.base import CHAOS
from vibrojax.studies.figures.base import add_ratio_axis, label, setting
from vibrojax.studies.figures.curves import Curves


def draw(data: xr.Dataset) -> Figure:
    """Section points above, exponent below, a line where motion is regular and a point for each value in chaos; zero as a line."""
    parameter = setting(data, "parameter")
    figure = new_figure(4.8, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    x, points, exponent = data[parameter].values, 1e3 * data["displacement"].values, data["exponent"].values
    chaotic = np.nan_to_num(exponent, nan=0.0) > CHAOS
    for where, colour in ((~chaotic, SKY), (chaotic, ORANGE)):
        top.plot(np.repeat(x[where], points.shape[1]), points[where].ravel(), ".", color=colour, ms=2, mew=0, rasterized=True)
    top.set_ylabel(AT_STROBES)
    curve = Curves(values=(0.0,), text="", name="regular")
    curve.draw(bottom, 0, x, np.where(chaotic, np.nan, exponent), ~chaotic[1:] & ~chaotic[:-1])
    bottom.plot(x[chaotic], exponent[chaotic], ".", color=ORANGE, ms=3, mew=0, label="chaos")
    bottom.axhline(0.0, color=GREY, lw=0.8)
    bottom.set(xlabel=label(data, parameter), ylabel="exponent per cycle")
    bottom.legend()
    add_ratio_axis(top, data, parameter)
    return figure
