"""Force against frequency, a line a gap, however many there are."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.studies.figures.base import label
from vibrojax.studies.figures.curves import gap_curves


def draw(data: xr.Dataset) -> Figure:
    """Largest impact force, and on the right its ratio to the hammer's weight; a panel for each value of a further axis."""
    further = [dim for dim in data["impact_force"].dims if dim not in ("gap", "frequency_hz")]
    panels = data.stack(panel=further) if further else data.expand_dims("panel")
    count = panels.sizes["panel"]
    figure = new_figure(2.6 * count + 0.4, layout="constrained")
    rows = np.atleast_1d(figure.subplots(count, 1, sharex=True))
    curves = gap_curves(data)
    for number, axes in enumerate(rows):
        part = panels.isel(panel=number)
        for gap, colour, name in zip(data["gap"].values, curves.colours, curves.names, strict=True):
            line = part.sel(gap=gap).transpose("frequency_hz", ...)
            axes.plot(data["frequency_hz"], line["impact_force"], color=colour, label=name)
        axes.set_ylabel("largest impact force (N)")
        force, ratio = part["impact_force"].values, part["force_over_weight"].values
        if np.any(force > 0):
            weight = float(np.median(force[force > 0] / ratio[force > 0]))
            right = axes.secondary_yaxis("right", functions=(lambda f, w=weight: f / w, lambda r, w=weight: r * w))
            right.set_ylabel("F / (m g)")
        if further:
            axes.set_title(", ".join(f"{dim} = {float(part[dim]):g} {data[dim].attrs['units']}" for dim in further), loc="left", fontsize=9)
    curves.explain(rows[0], list(rows))
    rows[-1].set_xlabel(label(data, "frequency_hz"))
    return figure
