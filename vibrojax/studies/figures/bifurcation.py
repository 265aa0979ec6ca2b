"""Section points and forces along the swept parameter."""

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrojax.drawing import SKY, new_figure
from vibrojax.figure_style import AT_STROBES, FORCE_OF_CYCLE
from vibrojax.studies.bifurcation import pieces
from vibrojax.studies.figures.base import add_ratio_axis, label, setting

DOWN = "#8c2d04"
"""Dark on the pale blue of the sweep up: they differ in grey too."""
_LOOKS = {"up": (SKY, 3.6, "--"), "down": (DOWN, 1.6, ":")}
"""Of each sweep: colour, size of its points, line at its jumps."""
_BRANCH = "#000000"
_UNDER = 4.0
"""Least size of points under a line."""
_MARGIN = 0.05
"""Of the range of the section points, left above and below."""


def draw(data: xr.Dataset) -> Figure:
    """Displacement at the strobes above, largest force of each cycle below; up pale and down dark, jumps as broken lines.

    Where branches are known (`with_branches`) the sweeps lie side by side, with the branches over both: stable orbits full,
    unstable ones broken.
    """
    return _apart(data) if "branches" in data.attrs else _together(data)


def _together(data: xr.Dataset) -> Figure:
    parameter = setting(data, "parameter")
    figure = new_figure(5.4, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for direction in _LOOKS:
        _draw_sweep(data, direction, top, bottom)
    top.set_ylabel(AT_STROBES)
    bottom.set_ylabel(FORCE_OF_CYCLE)
    bottom.set_xlabel(label(data, parameter))
    add_ratio_axis(top, data, parameter)
    top.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0) if parameter != "frequency_hz" else None)
    return figure


def _apart(data: xr.Dataset) -> Figure:
    parameter = setting(data, "parameter")
    figure = new_figure(5.4, 9.6, layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for direction, (top, bottom) in zip(_LOOKS, panels.T, strict=True):
        _draw_sweep(data, direction, top, bottom, _UNDER)
        for branch in json.loads(data.attrs["branches"]):
            _draw_branch(top, branch, "u", 1e3)
            if branch["force"]:
                _draw_branch(bottom, branch, "force", 1.0)
        bottom.set_xlabel(label(data, parameter))
        add_ratio_axis(top, data, parameter)
    top, bottom = panels[:, 0]
    top.set(ylabel=AT_STROBES, ylim=_limits(1e3 * data["displacement"].values))
    bottom.set(ylabel=FORCE_OF_CYCLE, ylim=_limits(data["impact_force"].values))
    x = data[parameter].values
    top.set_xlim(x[0], x[-1])
    top.plot([], [], color=_BRANCH, linewidth=1.0, label="stable orbits")
    top.plot([], [], color=_BRANCH, linewidth=1.0, linestyle="--", label="unstable orbits")
    up, down = (one.get_legend_handles_labels() for one in panels[0])
    figure.legend(up[0] + down[0], up[1] + down[1], loc="outside lower center", ncols=4)
    return figure


def _draw_sweep(data: xr.Dataset, direction: str, top: Axes, bottom: Axes, least: float = 0.0) -> None:
    """One sweep: its points in both panels, its jumps in the upper one."""
    (colour, size, dash), part = _LOOKS[direction], data.sel(direction=direction)
    x = data[setting(data, "parameter")].values
    for axes, name, scale in ((top, "displacement", 1e3), (bottom, "impact_force", 1.0)):
        points = scale * part[name].values
        axes.plot(np.repeat(x, points.shape[1]), points.ravel(), ".", color=colour, ms=max(size, least), mew=0, rasterized=True)
    jumps = x[part["jump"].values == 1]
    for place in jumps:
        top.axvline(place, color=colour, lw=0.8, ls=dash, zorder=0)
    count = "1 jump" if jumps.size == 1 else f"{jumps.size} jumps"
    top.plot([], [], ".", color=colour, ms=6, mew=0, label=f"{direction}, {count}")


def _draw_branch(axes: Axes, branch: dict[str, Any], name: str, scale: float) -> None:
    value, height, stable = (np.array(branch[key]) for key in ("value", name, "stable"))
    for chosen, dash in ((1, "-"), (0, "--")):
        axes.plot(value, pieces(scale * height, stable, chosen), color=_BRANCH, linewidth=0.8, linestyle=dash)


def _limits(values: np.ndarray) -> tuple[float, float]:
    """Ordinates of all points of the sweeps: a branch that leaves them is cut."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = _MARGIN * (high - low) or 1.0
    return low - room, high + room
