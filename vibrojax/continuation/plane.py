"""The borders of a branch in the plane of two parameters: all of them, as a table and a picture."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from vibrojax.continuation.border import FOLLOWED, Border, Bounds, border
from vibrojax.continuation.branch import Branch, End
from vibrojax.continuation.figure import MARKERS, axis_label
from vibrojax.drawing import new_figure
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate import Landing

_REACH = 1e-3
"""Of the ranges: a special point so near to a border lies on it."""
_LINES = ("-", "--", ":", "-.")


def borders(
    branch: Branch,
    along: str,
    bounds: tuple[Bounds, Bounds],
    *,
    landing: Landing | None = None,
    progress: Callable[[str], None] = lambda stage: None,
) -> tuple[list[Border], list[str]]:
    """Follow every fold, period doubling and grazing of a branch in a second parameter; those on one border are followed once.

    Arguments:
        branch: as followed along its own parameter.
        along: name of the second parameter.
        bounds: of both parameters, SI.
        landing: the integrator.
        progress: called with each special point.

    Returns:
        The borders, and a sentence on each special point from which none could be followed.
    """
    found: list[Border] = []
    lost: list[str] = []
    reach = (_REACH * (bounds[0][1] - bounds[0][0]), _REACH * (bounds[1][1] - bounds[1][0]))
    for place in branch.special:
        here = float(place.orbit.rig.value(along))
        known = (one for one in found if one.kind is place.kind)
        if place.kind not in FOLLOWED or any(one.holds(place.parameter, here, reach) for one in known):
            continue
        progress(f"following the {place.kind.value} at {place.parameter:.4g} along {along}")
        try:
            found.append(border(place, (branch.name, along), bounds, landing=landing))
        except NoConvergenceError as error:
            lost.append(f"{place.kind.value} at {place.parameter:.6g}: {error}")
    return found, lost


def csv(found: Sequence[Border]) -> str:
    """All borders as comma-separated text with a header, numbered in the first column."""
    lines: list[str] = []
    for number, one in enumerate(found, 1):
        columns = one.columns()
        lines = lines or [",".join(["border", *columns])]
        values = [np.asarray(column).tolist() for column in columns.values()]
        lines += [",".join([str(number), *(str(value) for value in row)]) for row in zip(*values, strict=True)]
    return "\n".join(lines) + "\n"


def draw(found: Sequence[Border]) -> Figure:
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


def _scale(label: str) -> float:
    return 1e3 if label.endswith(" (m)") else 1.0


def _in_mm(label: str) -> str:
    return label.removesuffix("(m)") + "(mm)" if label.endswith(" (m)") else label


def finding(found: Sequence[Border]) -> str:
    """One sentence: every border with the ranges that it spans, and why it ends within the plane where it does."""
    if not found:
        return "the branch has no fold, period doubling or grazing that could be followed"
    words = []
    for one in found:
        spans = [
            f"{name} {_scale(label) * float(values.min()):.4g} to {_scale(label) * float(values.max()):.4g} {_unit(_in_mm(label))}".strip()
            for name, values, label in zip(one.names, (one.first, one.second), one.labels, strict=True)
        ]
        short = [end.value for end in dict.fromkeys(one.ends) if end not in (End.BOUND, End.CLOSED)]
        within = f" (ends within this plane: {' and '.join(short)})" if short else ""
        words.append(f"{one.kind.value} of {_orbit(one)} at {' and '.join(spans)}{within}")
    return "; ".join(words)


def _unit(label: str) -> str:
    return label.rpartition(" ")[2].strip("()").removesuffix("1")


def _orbit(one: Border) -> str:
    return f"z = {one.touches}/{one.cycles}" if one.touches else "the motion without impact"
