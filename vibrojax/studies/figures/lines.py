"""Figures of the studies along a parameter, and how their curves differ: response, bifurcation, section, exponent, hammer design."""

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from vibrojax.drawing import BLUE, COLOURS, GREY, SKY, WIDTH, new_figure
from vibrojax.figure_style import AT_STROBES, FORCE, FORCE_OF_CYCLE, FORCE_OVER_WEIGHT, RATIO, SYMBOLS, short
from vibrojax.studies.base import APERIODIC, CHAOS, FAILED, NO_IMPACT, setting
from vibrojax.studies.coexistence import name as motion_name
from vibrojax.studies.continuation_lines import pieces


def label(data: xr.Dataset, name: str, scale: str = "") -> str:
    """Name of an axis: what it is, its symbol, and the unit in brackets."""
    part = data[name]
    unit = scale or part.attrs["units"]
    return (SYMBOLS.get(name) or str(part.attrs["long_name"])) + ("" if unit == "1" else f" ({unit})")


def add_ratio_axis(axes: Axes, data: xr.Dataset, name: str) -> None:
    """Omega/omega along the top of a panel whose abscissa is the excitation frequency in Hz, where the model has a natural frequency."""
    f_n = json.loads(data.attrs.get("model", "{}")).get("suspension", {}).get("natural_frequency_hz")
    if f_n and name == "frequency_hz":
        axes.secondary_xaxis("top", functions=(lambda f: np.asarray(f) / f_n, lambda r: np.asarray(r) * f_n)).set_xlabel(RATIO)


_DARK = LinearSegmentedColormap.from_list("dark cividis", matplotlib.colormaps["cividis"](np.linspace(0.0, 0.85, 64)))
"""Even in lightness, so that the colour-blind can read it too; its pale end is left out, which is lost on white."""
_DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1)), (0, (4, 1, 1, 1, 1, 1)), (0, (8, 2)))
_MARKS = ("o", "s", "^", "D", "v", "P", "X")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curves:
    """One curve for each value of a quantity: few have colour, dashes and marks of their own and a legend, many a colour map and its bar.

    Attributes:
        values: one a curve, in the unit of `text`.
        text: what the bar of many is called, such as "gap (mm)".
        name: of a curve in the legend of few, such as "gap {:g} mm".
    """

    values: tuple[float, ...]
    text: str
    name: str

    @property
    def few(self) -> bool:
        """Whether every curve has a colour of its own."""
        return len(self.values) <= len(COLOURS)

    def look(self, number: int) -> tuple[Any, Any, str, str]:
        """Colour, dashes, mark of lone points, and name in the legend of one curve; many differ in lightness alone, and have no name."""
        value = self.values[number]
        if self.few:
            return COLOURS[number], _DASHES[number], _MARKS[number], self.name.format(value)
        return _DARK(self._norm()(value)), "-", "o", ""

    def draw(self, axes: Axes, number: int, x: np.ndarray, y: np.ndarray, joined: np.ndarray) -> None:
        """Draw one curve: a line where neighbours have the same motion, a mark for each point that stands alone.

        Arguments:
            axes: the panel.
            number: of the curve.
            x: along the panel.
            y: values, NaN where there is none.
            joined: whether each point is joined to the next, one fewer than points.
        """
        colour, dash, mark, name = self.look(number)
        breaks = 1 + np.flatnonzero(~joined)
        alone = np.isfinite(y) & ~np.append(joined, False) & ~np.append(False, joined)
        if joined.any():
            line = np.insert(np.where(alone, np.nan, y), breaks, np.nan)
            axes.plot(np.insert(x, breaks, np.nan), line, color=colour, ls=dash, label=name or None)
        if alone.any():
            named = None if joined.any() else name or None
            axes.plot(x[alone], y[alone], mark, color=colour, ms=1.8, mew=0, label=named)

    def explain(self, first: Axes, panels: Sequence[Axes]) -> None:
        """Legend above the first panel, or a bar beside all of them."""
        if not self.few:
            bar = ScalarMappable(self._norm(), _DARK)
            first.figure.colorbar(bar, ax=list(panels), label=f"{self.text}, {len(self.values)} curves")
        elif first.get_legend_handles_labels()[0]:
            first.legend(handlelength=2.6)

    def _norm(self) -> Normalize:
        return Normalize(min(self.values), max(self.values))


def curves_along(data: xr.Dataset, name: str) -> Curves:
    """A curve for each value of an axis of a study."""
    scale, unit = (1e3, "mm") if name == "gap" else (1.0, data[name].attrs["units"])
    words = {"gap": "gap", "frequency_hz": r"$\Omega$ ="}.get(name, f"{short(name)} =")
    tail = "" if unit == "1" else f" {unit}"
    return Curves(
        values=tuple((scale * data[name].values).tolist()), text=label(data, name, unit), name=f"{words.replace('{', '{{')} {{:g}}{tail}"
    )


def same_motion(part: xr.Dataset) -> np.ndarray:
    """Whether neighbours along the only axis of a study settle on the same z = p/q, so that a line may join them; never in chaos."""
    kind = part["kind"].values
    steady = (kind != APERIODIC) & (kind != FAILED)
    alike = kind[1:] == kind[:-1]
    for name in ("impacts", "period"):
        alike &= (part[name].values[1:] == part[name].values[:-1]) | (kind[1:] == NO_IMPACT)
    return alike & steady[1:] & steady[:-1]


def draw_frequency_response(data: xr.Dataset) -> Figure:
    """Largest impact force, and on the right its ratio to the hammer's weight; a panel for each value of a further axis.

    A line joins neighbours of one motion z = p/q; points of chaos stand alone. Open marks are motions that coexist with it.
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
            colour, _, mark, _ = curves.look(curve)
            _draw_beside(axes, line, "other_force", 1.0, colour, mark)
        axes.set_ylabel(FORCE)
        force, ratio = part["impact_force"].values, part["force_over_weight"].values
        if np.any(force > 0) and "m" not in data.dims:
            weight = float(np.median(force[force > 0] / ratio[force > 0]))
            right = axes.secondary_yaxis("right", functions=(lambda f, w=weight: f / w, lambda r, w=weight: r * w))
            right.set_ylabel(FORCE_OVER_WEIGHT)
        if further and count > 1:
            names = [f"{short(str(dim))} = {float(part[dim]):g} {data[dim].attrs['units']}".removesuffix(" 1") for dim in further]
            axes.set_title(", ".join(names), loc="left")
    if "other_force" in data:
        rows[0].plot([], [], "o", mfc="none", mec=GREY, ms=2.5, mew=0.6, label=BESIDE)
    curves.explain(rows[0], list(rows))
    if "f_n" not in data.dims:
        add_ratio_axis(rows[0], data, "frequency_hz")
    rows[-1].set_xlabel(label(data, "frequency_hz"))
    return figure


BESIDE = "coexists"
"""What open marks are called."""


def _draw_beside(axes: Axes, data: xr.Dataset, name: str, scale: float, colour: Any, mark: str = "o") -> None:
    """The motions beside that of a study along its only axis, as open marks (`coexistence.with_coexistence`); nothing where unknown."""
    if name in data:
        along = str(data["asked"].dims[0])
        values = scale * data[name].transpose(along, ...).values.reshape(data.sizes[along], -1)
        x = np.repeat(data[along].values, values.shape[1])
        axes.plot(x, values.ravel(), mark, mfc="none", mec=colour, ms=2.5, mew=0.6, zorder=1.5)


def curve_axis(data: xr.Dataset) -> str:
    """The axis with a curve for each of its values: the gap, or where there is but one gap, the only other axis."""
    others = [str(dim) for dim in data["impact_force"].dims if dim not in ("gap", "frequency_hz", "quantile")]
    return others[0] if len(others) == 1 and data.sizes["gap"] == 1 else "gap"


def draw_hammer_design(data: xr.Dataset) -> Figure:
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


def draw_lyapunov(data: xr.Dataset) -> Figure:
    """Both exponents over the bifurcation diagram, on one abscissa; chaos is shaded through both panels, zero is a line."""
    parameter = setting(data, "parameter")
    figure = new_figure(5.4, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 3))
    x, points, exponent = data[parameter].values, 1e3 * data["displacement"].values, data["exponent"].values
    chaotic = np.nan_to_num(exponent, nan=0.0) > CHAOS
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    for axes in (top, bottom):
        for place in np.flatnonzero(chaotic):
            axes.axvspan(edges[place], edges[place + 1], color=SHADE, lw=0, zorder=0)
    alike = chaotic[1:] == chaotic[:-1]
    for number, (name, text) in enumerate((("exponent", "largest"), ("second_exponent", "second"))):
        Curves(values=(0.0, 1.0), text="", name=text).draw(top, number, x, data[name].values, alike & np.isfinite(exponent[1:]))
    top.axhline(0.0, color=GREY, lw=0.8)
    low, high = np.nanmin(exponent, initial=0.0), np.nanmax(exponent, initial=0.0)
    top.set(ylabel="exponents per cycle", ylim=(min(2.0 * low, -_LEAST), max(1.3 * high, _LEAST)))
    top.fill_between([], [], color=SHADE, label="chaos")
    figure.legend(*top.get_legend_handles_labels(), ncols=3, loc="outside lower center")
    for where, colour in ((~chaotic, BLUE), (chaotic, DOWN)):
        bottom.plot(np.repeat(x[where], points.shape[1]), points[where].ravel(), ".", color=colour, ms=2.4, mew=0, rasterized=True)
    bottom.set(xlabel=label(data, parameter), ylabel=AT_STROBES, xlim=(x[0], x[-1]))
    add_ratio_axis(top, data, parameter)
    return figure


SHADE = "#fbe3c8"
"""Behind what is chaotic."""
_LEAST = 0.2
"""Exponent that the ordinate reaches on either side of zero."""
DOWN = "#8c2d04"
"""Dark on the pale blue of the sweep up: they differ in grey too."""
_LOOKS = {"up": (SKY, 3.6, "--"), "down": (DOWN, 1.6, ":")}
"""Of each sweep: colour, size of its points, line at its jumps."""
_BRANCH = "#000000"
_UNDER = 4.0
"""Least size of points under a line."""
_MARGIN = 0.05
"""Of the range of the section points, left above and below."""


def draw_bifurcation(data: xr.Dataset) -> Figure:
    """Displacement at the strobes above, largest force of each cycle below; up pale and down dark, jumps as broken lines.

    Where branches are known (`continuation_lines.with_branches`) the sweeps lie side by side, with the branches over both: stable orbits
    full, unstable ones broken.
    """
    parameter, apart = setting(data, "parameter"), "branches" in data.attrs
    figure = new_figure(5.4, 9.6 if apart else WIDTH, layout="constrained")
    panels = figure.subplots(2, 2 if apart else 1, sharex=True, sharey="row", squeeze=False)
    for direction, (top, bottom) in zip(_LOOKS, np.broadcast_to(panels.T, (2, 2)), strict=True):
        _draw_sweep(data, direction, top, bottom, _UNDER if apart else 0.0)
    for top, bottom in panels.T:
        for branch in json.loads(data.attrs.get("branches", "[]")):
            _draw_branch(top, branch, "u", 1e3)
            if branch["force"]:
                _draw_branch(bottom, branch, "force", 1.0)
        bottom.set_xlabel(label(data, parameter))
        add_ratio_axis(top, data, parameter)
    top, bottom = panels[:, 0]
    top.set_ylabel(AT_STROBES)
    bottom.set_ylabel(FORCE_OF_CYCLE)
    if not apart:
        for axes, name, scale in ((top, "other_displacement", 1e3), (bottom, "other_force", 1.0)):
            _draw_beside(axes, data, name, scale, GREY)
        if "other_force" in data:
            top.plot([], [], "o", mfc="none", mec=GREY, ms=2.5, mew=0.6, label=BESIDE)
        top.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0) if parameter != "frequency_hz" else None)
        return figure
    x = data[parameter].values
    top.set(ylim=_limits(1e3 * data["displacement"].values), xlim=(x[0], x[-1]))
    bottom.set_ylim(_limits(data["impact_force"].values))
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


_NARROWEST = 0.02
"""Of the phase plane; a section no wider than rounding is a point, not a cloud."""


def draw_section(data: xr.Dataset) -> Figure:
    """Section points and phase plane above; displacement, force and acceleration over a few cycles below."""
    figure = new_figure(7.6, layout="constrained")
    plan = figure.subplot_mosaic([["section", "plane"], ["u", "u"], ["force", "force"], ["acceleration", "acceleration"]])
    gap = 1e3 * setting(data, "gap")
    section, plane = plan["section"], plan["plane"]
    section.plot(1e3 * data["displacement"], data["velocity"], ".", color=COLOURS[0], ms=3, mew=0)
    if "other_displacement" in data:
        _draw_others_of_section(section, data)
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


def _draw_others_of_section(axes: Axes, data: xr.Dataset) -> None:
    """Section points of the motions beside that of a section, open, each named."""
    for number, of in enumerate(data["other_code"].values.tolist()):
        if of >= 0:
            u, v = (scale * data[f"other_{part}"].values[number] for part, scale in (("displacement", 1e3), ("velocity", 1.0)))
            axes.plot(u, v, _MARKS[(number + 1) % len(_MARKS)], mfc="none", mec=COLOURS[1], ms=4, mew=0.8, label=motion_name(of))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(title=BESIDE, loc="best")


def _no_narrower(limits: tuple[float, float], width: float) -> tuple[float, float]:
    """Limits of an axis about the same middle, so far apart at least."""
    low, high = limits
    half = 0.5 * max(high - low, width)
    return 0.5 * (low + high) - half, 0.5 * (low + high) + half
