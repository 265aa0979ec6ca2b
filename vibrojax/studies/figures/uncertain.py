"""The studies over the draws of a fit: median, the middle 50 % and 95 % as bands, probabilities of kinds of motion."""

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.figure_style import AT_STROBES, FORCE, FORCE_OF_CYCLE, FORCE_OVER_WEIGHT
from vibrojax.studies.base import setting
from vibrojax.studies.figures.lines import curve_axis, curves_along, label
from vibrojax.studies.figures.maps import draw_values, finish_map

_BANDS = ((0, 4, 0.18), (1, 3, 0.35))
"""Lower and upper quantile, opacity."""
_LIKELY = 0.5


def force_curves(data: xr.Dataset) -> Figure:
    """Force against frequency, a colour a gap, or against the hammer's mass, a colour a frequency; below, the probability of z = 1/1."""
    along, by = ("mass_ratio", "frequency_hz") if "mass_ratio" in data.dims else ("frequency_hz", curve_axis(data))
    figure = new_figure(5.4, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    curves = curves_along(data, by)
    for number, value in enumerate(data[by].values):
        part = data.sel({by: value})
        part = part.squeeze([dim for dim in part["impact_force"].dims if dim not in (along, "quantile")])
        colour, dash, _, name = curves.look(number)
        _band(top, part[along], part["impact_force"], colour, name, dash)
        bottom.plot(part[along], part["probability_1_1"], color=colour, ls=dash)
    _finish(top, bottom, data, FORCE, "probability of z = 1/1", along)
    curves.explain(top, [top, bottom])
    return figure


def lyapunov(data: xr.Dataset) -> Figure:
    """The exponent, and below the probability of chaos."""
    parameter = setting(data, "parameter")
    figure = new_figure(4.8, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    _band(top, data[parameter], data["exponent"], COLOURS[1], "exponent per cycle")
    top.axhline(0.0, color="#606060", lw=0.8)
    bottom.plot(data[parameter], data["probability_chaos"], color=COLOURS[1])
    _finish(top, bottom, data, "exponent per cycle", "probability of chaos", parameter)
    top.legend()
    return figure


def bifurcation(data: xr.Dataset) -> Figure:
    """Lowest and highest section point, largest force, and where the sweeps jump."""
    parameter = setting(data, "parameter")
    figure = new_figure(6.6, layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2, 2, 1))
    for direction, colour, dash in (("up", COLOURS[0], "-"), ("down", COLOURS[1], "--")):
        part = data.sel(direction=direction)
        for name, text in (("displacement_lowest", direction), ("displacement_highest", "")):
            _band(top, data[parameter], 1e3 * part[name], colour, text, dash)
        _band(middle, data[parameter], part["impact_force"], colour, "", dash)
        bottom.plot(data[parameter], part["probability_jump"], color=colour, ls=dash)
    middle.set_ylabel(FORCE_OF_CYCLE)
    _finish(top, bottom, data, f"{AT_STROBES},\nlowest and highest", "probability\nof a jump", parameter)
    top.legend()
    return figure


def peterka(data: xr.Dataset) -> Figure:
    """Probability of z = 1/1, and the median force where z = 1/1 is the likely motion."""
    figure = new_figure(4.2, 9.6, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    x, y = data["ratio"].values, data["clearance"].values
    first = data["probability_1_1"].values
    draw_values(left, x, y, first, "probability of z = 1/1", cmap="cividis", vmin=0.0, vmax=1.0)
    force = np.where(first >= _LIKELY, data["force_over_weight"].sel(quantile=0.5).values, np.nan)
    draw_values(right, x, y, force, f"{FORCE_OVER_WEIGHT} on z = 1/1, median")
    finish_map(left, right, data)
    right.set_title(f"where its probability is at least {_LIKELY:g}", loc="left")
    left.set_title(f"{data.attrs['draws']} draws of the fit", loc="left")
    return figure


def basins(data: xr.Dataset) -> Figure:
    """Probability that the motion from an initial state keeps impacting."""
    figure = new_figure(4.4, layout="constrained")
    axes = figure.subplots()
    plane = 1e3 * data["u0"].values, data["v0"].values, data["probability_impacting"].transpose("v0", "u0").values
    draw_values(axes, *plane, "probability that the motion keeps impacting", cmap="cividis", vmin=0.0, vmax=1.0)
    low, middle, high = (100 * float(data["basin_measure"].isel(quantile=i)) for i in (0, 2, 4))
    axes.set_title(f"share that keeps impacting: {middle:.1f} % ({low:.1f} to {high:.1f} %)", loc="left")
    axes.set(xlabel="initial displacement relative to the cart (mm)", ylabel="initial velocity (m/s)")
    axes.grid(False)
    return figure


def section(data: xr.Dataset) -> Figure:
    """Histories of a few cycles."""
    figure = new_figure(5.4, layout="constrained")
    rows = (
        ("u", 1e3, "$u$ (mm)"),
        ("impact_force", 1.0, "$F_i$ (N)"),
        ("hammer_acceleration", 1.0, r"$\ddot{x}$ (m/s²)"),
    )
    panels = figure.subplots(3, 1, sharex=True)
    for axes, (name, scale, text) in zip(panels, rows, strict=True):
        _band(axes, data["time"], scale * data[name], COLOURS[0], "")
        axes.set_ylabel(text)
    panels[0].axhline(1e3 * setting(data, "gap"), color=COLOURS[1], lw=0.8, ls="--", label="stop")
    panels[0].legend(loc="upper right")
    panels[-1].set_xlabel("time since a strobe (s)")
    return figure


UNCERTAIN: dict[str, Callable[[xr.Dataset], Figure]] = {
    "response": force_curves,
    "bifurcation": bifurcation,
    "peterka": peterka,
    "section": section,
    "basins": basins,
    "lyapunov": lyapunov,
    "design": force_curves,
}
"""By the name of the command."""


def _band(axes: Axes, x: xr.DataArray, part: xr.DataArray, colour: Any, name: str, dash: Any = "-") -> None:
    """Median and bands of one line."""
    values = part.transpose("quantile", ...).values
    for low, high, opacity in _BANDS:
        axes.fill_between(x.values, values[low], values[high], color=colour, alpha=opacity, lw=0)
    axes.plot(x.values, values[2], color=colour, ls=dash, label=name or None)


def _finish(top: Axes, bottom: Axes, data: xr.Dataset, above: str, below: str, along: str) -> None:
    top.set_ylabel(above)
    top.set_title(f"median, middle 50 % and 95 % of {data.attrs['draws']} draws of the fit", loc="left")
    bottom.set(xlabel=label(data, along), ylabel=below, ylim=(-0.03, 1.03))
