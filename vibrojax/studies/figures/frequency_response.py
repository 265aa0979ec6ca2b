"""Force against frequency, a line a gap."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.studies.figures.base import label


def draw(data: xr.Dataset) -> Figure:
    """Largest impact force, and on the right its ratio to the hammer's weight; a panel for each value of a further axis."""
    further = [dim for dim in data["impact_force"].dims if dim not in ("gap", "frequency_hz")]
    panels = data.stack(panel=further) if further else data.expand_dims("panel")
    count = panels.sizes["panel"]
    figure = new_figure(2.6 * count + 0.4, layout="constrained")
    rows = np.atleast_1d(figure.subplots(count, 1, sharex=True))
    for number, axes in enumerate(rows):
        part = panels.isel(panel=number)
        for colour, gap in zip(COLOURS, data["gap"].values, strict=False):
            line = part.sel(gap=gap).transpose("frequency_hz", ...)
            axes.plot(data["frequency_hz"], line["impact_force"], color=colour, label=f"gap {1e3 * gap:g} mm")
        axes.set_ylabel("largest impact force (N)")
        force, ratio = part["impact_force"].values, part["force_over_weight"].values
        if np.any(force > 0):
            weight = float(np.median(force[force > 0] / ratio[force > 0]))
            right = axes.secondary_yaxis("right", functions=(lambda f, w=weight: f / w, lambda r, w=weight: r * w))
            right.set_ylabel("F / (m g)")
        if further:
            axes.set_title(", ".join(f"{dim} = {float(part[dim]):g} {data[dim].attrs['units']}" for dim in further), loc="left", fontsize=9)
    rows[0].legend()
    rows[-1].set_xlabel(label(data, "frequency_hz"))
    return figure
