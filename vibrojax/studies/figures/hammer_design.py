"""Force against mass ratio, a line a frequency, however many there are."""

import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.studies.figures.base import label
from vibrojax.studies.figures.curves import frequency_curves


def draw(data: xr.Dataset) -> Figure:
    """Largest impact force against the hammer's mass over that of the model."""
    figure = new_figure(3.6, layout="constrained")
    axes = figure.subplots()
    curves = frequency_curves(data)
    for frequency, colour, name in zip(data["frequency_hz"].values, curves.colours, curves.names, strict=True):
        axes.plot(data["mass_ratio"], data["impact_force"].sel(frequency_hz=frequency), color=colour, label=name)
    axes.set(xlabel=label(data, "mass_ratio"), ylabel="largest impact force (N)")
    curves.explain(axes, [axes])
    return figure
