"""Branches and borders in pictures, and in one sentence each for the terminal and the caption."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrojax.continuation.border import Border
from vibrojax.continuation.branch import Branch, End, Kind, SpecialPoint
from vibrojax.drawing import COLOURS, GREEN, ORANGE, PINK, new_figure
from vibrojax.figure_style import FORCE, SYMBOLS

_LINES = ("-", "--", ":", "-.")
"""Of borders, by number."""
MARKERS = {
    Kind.FOLD: ("o", "#000000"),
    Kind.BRANCH_POINT: ("x", "#000000"),
    Kind.PERIOD_DOUBLING: ("D", ORANGE),
    Kind.TORUS: ("*", PINK),
    Kind.GRAZING: ("^", GREEN),
    Kind.GRAZING_FOLD: ("v", GREEN),
}


def draw_branches(branches: list[Branch], *, title: str = "") -> Figure:
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


def draw_borders(found: Sequence[Border]) -> Figure:
    """The borders in the plane: colour by kind, line by number. Make it within `vibrojax.drawing.style`."""
    figure = new_figure(4.2, layout="constrained")
    axes = figure.subplots()
    for number, one in enumerate(found):
        label = f"{one.kind.value}, " + (f"z = {one.touches}/{one.cycles}" if one.touches else "no impact")
        line, colour = _LINES[number % len(_LINES)], MARKERS[one.kind][1]
        x, y = (_scale(text) * values for text, values in zip(one.labels, (one.first, one.second), strict=True))
        axes.plot(x, y, color=colour, linestyle=line, linewidth=1.4, label=label)
    if found:
        x_label, y_label = (axis_label(name, _in_mm(text)) for name, text in zip(found[0].names, found[0].labels, strict=True))
        axes.set(xlabel=x_label, ylabel=y_label)
        figure.legend(loc="outside upper center", ncols=2)
    return figure


def branch_finding(branch: Branch) -> str:
    """Where its orbits are stable, where they change, and where the impact is strongest on the stable ones."""
    x, unit = branch.parameter, branch.label.rpartition(" ")[2].strip("()")
    stable, touches = branch.stable, branch.touches
    kinds = np.where(stable, touches, -1)
    if End.CLOSED in branch.ends and (changes := np.flatnonzero(kinds[1:] != kinds[:-1])).size:  # a stretch across the first point
        x, kinds, touches, stable = (np.roll(part, -1 - changes[0]) for part in (x, kinds, touches, stable))
    starts = [0, *(1 + np.flatnonzero(kinds[1:] != kinds[:-1])), len(kinds)]
    stretches: dict[str, list[str]] = {}
    for a, b in zip(starts[:-1], starts[1:], strict=True):
        if stable[a]:
            name = f"z = {touches[a]}/{branch.cycles}" if touches[a] else "no impact"
            low, high = float(x[a:b].min()), float(x[a:b].max())
            stretches.setdefault(name, []).append(f"from {low:.4g} to {high:.4g} {unit}")
    words = [f"{name} stable {' and '.join(parts)}" for name, parts in sorted(stretches.items(), reverse=True)] or ["nowhere stable"]
    places = [f"{place.kind.value} at {place.parameter:.4g} {unit}" for place in branch.special]
    sentence = ", ".join([*words, *places])
    strength, symbol = (branch.impact_speed, "impact speed {:.3g} m/s") if branch.rigid else (branch.peak_force, "F_i {:.3g} N")
    if branch.stable.any() and strength[branch.stable].max() > 0:
        top = int(np.argmax(np.where(branch.stable, strength, -np.inf)))
        sentence += f", largest stable {symbol.format(strength[top])} at {branch.parameter[top]:.4g} {unit}"
    return sentence


def borders_finding(found: Sequence[Border]) -> str:
    """One sentence: every border with the ranges that it spans, and why it ends within the plane where it does."""
    if not found:
        return "the branch has no fold, period doubling or grazing that could be followed"
    words = []
    for one in found:
        orbit, spans = f"z = {one.touches}/{one.cycles}" if one.touches else "the motion without impact", []
        for name, values, label in zip(one.names, (one.first, one.second), one.labels, strict=True):
            ends, unit = _scale(label) * np.array([values.min(), values.max()]), _in_mm(label).rpartition(" ")[2].strip("()")
            spans.append(f"{name} {ends[0]:.4g} to {ends[1]:.4g} {unit}".removesuffix("1").strip())
        short = [end.value for end in dict.fromkeys(one.ends) if end not in (End.BOUND, End.CLOSED)]
        within = f" (ends within this plane: {' and '.join(short)})" if short else ""
        words.append(f"{one.kind.value} of {orbit} at {' and '.join(spans)}{within}")
    return "; ".join(words)


def _scale(label: str) -> float:
    return 1e3 if label.endswith(" (m)") else 1.0


def _in_mm(label: str) -> str:
    return label.removesuffix("(m)") + "(mm)" if label.endswith(" (m)") else label
