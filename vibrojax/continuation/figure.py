"""The picture of a branch: stable solid, unstable dashed, special points marked."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrojax.continuation.branch import Branch, End
from vibrojax.continuation.special import Kind, SpecialPoint
from vibrojax.drawing import COLOURS, GREEN, ORANGE, PINK, new_figure
from vibrojax.figure_style import FORCE, SYMBOLS

MARKERS = {
    Kind.FOLD: ("o", "#000000"),
    Kind.BRANCH_POINT: ("x", "#000000"),
    Kind.PERIOD_DOUBLING: ("D", ORANGE),
    Kind.TORUS: ("*", PINK),
    Kind.GRAZING: ("^", GREEN),
    Kind.GRAZING_FOLD: ("v", GREEN),
}


def draw(branches: list[Branch], *, title: str = "") -> Figure:
    """Two panels over the parameter: largest relative displacement, and peak force (impact speed where the stop is rigid).

    Make it within `vibrojax.drawing.style`.

    Arguments:
        branches: along the same parameter, one colour each.
        title: above the picture.
    """
    figure = new_figure(5.4, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for colour, branch in zip(COLOURS * len(branches), branches, strict=False):
        _line(above, branch, 1e3 * branch.highest, colour)
        _line(below, branch, branch.impact_speed if branch.rigid else branch.peak_force, colour)
        for place in branch.special:
            _mark(above, place, 1e3 * float(place.orbit.passage.highest))
            passage = place.orbit.passage
            _mark(below, place, float(passage.fastest_touch if branch.rigid else passage.peak_force))
    above.set(ylabel="largest $u$ (mm)", title=title)
    below.set(xlabel=axis_label(branches[0].name, branches[0].label), ylabel="impact speed (m/s)" if branches[0].rigid else FORCE)
    _legend(above, branches)
    return figure


def axis_label(name: str, label: str) -> str:
    """Symbol and unit of a parameter, as axes have it.

    Arguments:
        name: of the parameter.
        label: symbol and unit as text.
    """
    unit = label.rpartition(" ")[2]
    return f"{SYMBOLS[name]} {unit}".removesuffix(" (1)") if name in SYMBOLS else label


def _line(axes: Axes, branch: Branch, values: np.ndarray, colour: str) -> None:
    """Stretches of one stability, the step from one to the next drawn as unstable."""
    parameter, stable = branch.parameter, branch.stable
    if End.CLOSED in branch.ends:  # back to the first point
        parameter, values, stable = (np.append(part, part[0]) for part in (parameter, values, stable))
    changes = np.flatnonzero(stable[1:] != stable[:-1]) + 1
    for begin, end in zip([0, *changes], [*changes, len(stable)], strict=True):
        solid = bool(stable[begin])
        part = slice(begin, end) if solid else slice(max(begin - 1, 0), end + 1)
        axes.plot(parameter[part], values[part], color=colour, linestyle="-" if solid else "--", linewidth=1.6 if solid else 1.0)


def _mark(axes: Axes, place: SpecialPoint, value: float) -> None:
    marker, colour = MARKERS[place.kind]
    axes.plot(place.parameter, value, marker=marker, color=colour, markersize=5, linestyle="none", zorder=3)


def _legend(axes: Axes, branches: list[Branch]) -> None:
    """Outside the curves, above the upper panel's right half."""
    for linestyle, label in (("-", "stable"), ("--", "unstable")):
        axes.plot([], [], color="#404040", linestyle=linestyle, label=label)
    for kind in Kind:
        if any(place.kind is kind for branch in branches for place in branch.special):
            marker, colour = MARKERS[kind]
            axes.plot([], [], marker=marker, color=colour, linestyle="none", markersize=5, label=kind.value)
    if len(branches) > 1:
        for colour, branch in zip(COLOURS * len(branches), branches, strict=False):
            axes.plot([], [], color=colour, label=f"z = {int(branch.touches.max())}/{branch.cycles}")
    axes.legend(loc="best", ncols=2)
