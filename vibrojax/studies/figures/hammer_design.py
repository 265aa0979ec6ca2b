"""Force against mass ratio, a line a frequency, however many there are."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.figure_style import FORCE, FORCE_OVER_WEIGHT
from vibrojax.studies.classify import FAILED
from vibrojax.studies.figures.base import label
from vibrojax.studies.figures.curves import curves_along, same_motion


def draw(data: xr.Dataset) -> Figure:
    """Largest impact force against the hammer's mass over that of the model, and below the same over the hammer's weight.

    A line joins neighbours of one motion z = p/q; points of chaos stand alone.
    """
    figure = new_figure(5.0, layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    curves, x = curves_along(data, "frequency_hz"), data["mass_ratio"].values
    for number, frequency in enumerate(data["frequency_hz"].values):
        part = data.sel(frequency_hz=frequency)
        for axes, name in zip(panels, ("impact_force", "force_over_weight"), strict=True):
            curves.draw(axes, number, x, np.where(part["kind"].values == FAILED, np.nan, part[name].values), same_motion(part))
    for axes, text in zip(panels, (FORCE, FORCE_OVER_WEIGHT), strict=True):
        axes.set_ylabel(text)
    panels[1].set_xlabel(label(data, "mass_ratio"))
    curves.explain(panels[0], list(panels))
    return figure
