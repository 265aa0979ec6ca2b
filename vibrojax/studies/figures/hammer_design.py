"""Force against mass ratio, a line a frequency."""

import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.studies.figures.base import label


def draw(data: xr.Dataset) -> Figure:
    """Largest impact force against the hammer's mass over that of the model."""
    figure = new_figure(3.6, layout="constrained")
    axes = figure.subplots()
    for colour, frequency in zip(COLOURS, data["frequency_hz"].values, strict=False):
        axes.plot(data["mass_ratio"], data["impact_force"].sel(frequency_hz=frequency), color=colour, label=f"{frequency:g} Hz")
    axes.set(xlabel=label(data, "mass_ratio"), ylabel="largest impact force (N)")
    axes.legend()
    return figure
