"""One operating point: section, phase plane, histories."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import COLOURS, new_figure
from vibrojax.figure_style import AT_STROBES
from vibrojax.studies.figures.base import setting

_NARROWEST = 0.02
"""Of the phase plane; a section no wider than rounding is a point, not a cloud."""


def draw(data: xr.Dataset) -> Figure:
    """Section points and phase plane above; displacement, force and acceleration over a few cycles below."""
    figure = new_figure(7.6, layout="constrained")
    plan = figure.subplot_mosaic([["section", "plane"], ["u", "u"], ["force", "force"], ["acceleration", "acceleration"]])
    gap = 1e3 * setting(data, "gap")
    section, plane = plan["section"], plan["plane"]
    section.plot(1e3 * data["displacement"], data["velocity"], ".", color=COLOURS[0], ms=3, mew=0)
    section.set(xlabel=AT_STROBES, ylabel=r"$\dot{u}$ (m/s)")
    section.set_xlim(_no_narrower(section.get_xlim(), _NARROWEST * 1e3 * np.ptp(data["u"].values)))
    section.set_ylim(_no_narrower(section.get_ylim(), _NARROWEST * np.ptp(data["v"].values)))
    section.locator_params(axis="x", nbins=4)
    plane.plot(1e3 * data["u"], data["v"], color=COLOURS[0], lw=0.8)
    plane.axvline(gap, color=COLOURS[1], lw=0.8, ls="--")
    plane.set(xlabel="$u$ (mm)", ylabel=r"$\dot{u}$ (m/s)")
    rows = (("u", "u", 1e3, "$u$ (mm)"), ("force", "impact_force", 1.0, "$F_i$ (N)"))
    for place, name, scale, text in (*rows, ("acceleration", "hammer_acceleration", 1.0, r"$\ddot{x}$ (m/s²)")):
        plan[place].plot(data["time"], scale * data[name], color=COLOURS[0], lw=0.8)
        plan[place].set_ylabel(text)
    for place in ("u", "force"):
        plan[place].sharex(plan["acceleration"])
        plan[place].tick_params(labelbottom=False)
    plan["u"].axhline(gap, color=COLOURS[1], lw=0.8, ls="--", label="stop")
    plan["u"].legend(loc="upper right")
    plan["acceleration"].set_xlabel("time since a strobe (s)")
    return figure


def _no_narrower(limits: tuple[float, float], width: float) -> tuple[float, float]:
    """Limits of an axis about the same middle, so far apart at least."""
    low, high = limits
    half = 0.5 * max(high - low, width)
    return 0.5 * (low + high) - half, 0.5 * (low + high) + half
