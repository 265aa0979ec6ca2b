"""Largest impact force against frequency, a line a gap or a value of another axis; and against mass ratio, a line a frequency."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.figure_style import FORCE, FORCE_OVER_WEIGHT, short
from vibrojax.studies.classify import FAILED
from vibrojax.studies.figures.base import add_ratio_axis, label
from vibrojax.studies.figures.curves import curves_along, same_motion


def draw_response(data: xr.Dataset) -> Figure:
    """Largest impact force, and on the right its ratio to the hammer's weight; a panel for each value of a further axis.

    A line joins neighbours of one motion z = p/q; points of chaos stand alone.
    """
    along = curve_axis(data)
    further = [dim for dim in data["impact_force"].dims if dim not in (along, "frequency_hz")]
    panels = data.stack(panel=further) if further else data.expand_dims("panel")
    count = panels.sizes["panel"]
    figure = new_figure(2.6 * count + 0.6, layout="constrained")
    rows = np.atleast_1d(figure.subplots(count, 1, sharex=True))
    curves, x = curves_along(data, along), data["frequency_hz"].values
    for number, axes in enumerate(rows):
        part = panels.isel(panel=number)
        for curve, value in enumerate(data[along].values):
            line = part.sel({along: value}).transpose("frequency_hz", ...)
            force = np.where(line["kind"].values == FAILED, np.nan, line["impact_force"].values)
            curves.draw(axes, curve, x, force, same_motion(line))
        axes.set_ylabel(FORCE)
        force, ratio = part["impact_force"].values, part["force_over_weight"].values
        if np.any(force > 0) and "m" not in data.dims:
            weight = float(np.median(force[force > 0] / ratio[force > 0]))
            right = axes.secondary_yaxis("right", functions=(lambda f, w=weight: f / w, lambda r, w=weight: r * w))
            right.set_ylabel(FORCE_OVER_WEIGHT)
        if further and count > 1:
            names = [f"{short(str(dim))} = {float(part[dim]):g} {data[dim].attrs['units']}".removesuffix(" 1") for dim in further]
            axes.set_title(", ".join(names), loc="left")
    curves.explain(rows[0], list(rows))
    if "f_n" not in data.dims:
        add_ratio_axis(rows[0], data, "frequency_hz")
    rows[-1].set_xlabel(label(data, "frequency_hz"))
    return figure


def curve_axis(data: xr.Dataset) -> str:
    """The axis with a curve for each of its values: the gap, or where there is but one gap, the only other axis."""
    others = [str(dim) for dim in data["impact_force"].dims if dim not in ("gap", "frequency_hz", "quantile")]
    return others[0] if len(others) == 1 and data.sizes["gap"] == 1 else "gap"


def draw_design(data: xr.Dataset) -> Figure:
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
