"""From a rig to files: settle, shoot and follow; then tables, pictures, and one sentence each for the terminal and the caption."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import jax
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrojax import __version__
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.border import Border, Bounds, border_table, borders
from vibrojax.continuation.branch import Branch, End, Kind, SpecialPoint
from vibrojax.continuation.follow import doubled, follow
from vibrojax.continuation.orbit import find_orbit, settle
from vibrojax.continuation.rig import SETTINGS, ForcedRig, check_settings
from vibrojax.drawing import COLOURS, GREEN, ORANGE, PINK, new_figure, write_figure
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.figure_style import FORCE, SCREEN, SYMBOLS, FigureStyle, rig_words, written
from vibrojax.integrate import Landing
from vibrojax.model_file import model_document


def follow_and_write(
    rig: ForcedRig,
    name: str,
    bounds: tuple[float, float],
    folder: Path,
    *,
    at: float,
    start: tuple[float, float] = (0.0, 0.0),
    doublings: int = 0,
    landing: Landing | None = None,
    tail: str = "",
    look: FigureStyle = SCREEN,
    progress: Callable[[str], None] = lambda stage: None,
) -> list[Branch]:
    """Settle onto a stable orbit at one value of a parameter, follow its branch and those that are born from it, and write them.

    The files are `branch.csv`, `special.json`, the figure as `branch.png`, `branch.pdf` and `branch.svg`, and its caption `branch.md`,
    each with `tail` at the end of its name; the table and the special points of the first branch born by period doubling are in
    `branch_doubled-1.csv` and `special_doubled-1.json`.

    Arguments:
        rig: the rig.
        name: of the parameter.
        bounds: its range, SI.
        folder: that exists.
        at: value at which the rig settles.
        start: (u, u') from which it settles, m and m/s.
        doublings: how many period doublings in a row are followed.
        landing: the integrator.
        tail: of the files' names.
        look: sizes of the figure.
        progress: called with each stage.

    Returns:
        The branch, and those of twice, four times, ... its period.

    Raises:
        InputError: as for `follow`.
        NoConvergenceError: the motion from `start` does not settle onto an orbit.
    """
    if not bounds[0] <= at <= bounds[1]:
        raise InputError(
            f"the first orbit is looked for at {name} = {at:g}: expected a value from {bounds[0]:g} to {bounds[1]:g}; correct it"
        )
    for value in bounds:
        check_settings(rig.replace(name, value))
    rig = rig.replace(name, at)
    if isinstance(rig.model.law, AbstractInstantaneousLaw) and start[0] > float(rig.gap):
        raise InputError(f"the start lies {start[0] - float(rig.gap):g} m behind a rigid stop: expected u <= gap; move one of them")
    progress("settling onto an orbit")
    state, cycles = settle(rig, np.array([*start, *np.zeros(rig.size - 2)]), landing=landing)
    orbit = find_orbit(rig, state, cycles=cycles, landing=landing)
    progress(f"following the branch of an orbit of {cycles} cycles, {orbit.touches} impacts")
    branches = generation = [follow(orbit, name, bounds, landing=landing)]
    for _ in range(doublings):
        generation = [new for one in generation for new in _born(one, bounds, landing, progress)]
        branches = [*branches, *generation]
    progress("writing")
    settings = {setting: float(rig.value(setting)) for setting in SETTINGS}
    provenance = {"vibrojax": __version__, "jax": jax.__version__, "settings": settings, "start": list(start), "at": at}
    for number, branch in enumerate(branches):
        born = f"_doubled-{number}" if number else ""
        (folder / f"branch{born}{tail}.csv").write_text(branch.csv(), encoding="utf-8")
        document = {
            "parameter": name,
            "unit": rig.unit(name),
            "cycles": branch.cycles,
            "ends": [end.value for end in branch.ends],
            "special": branch.special_table(),
            "provenance": provenance,
        }
        (folder / f"special{born}{tail}.json").write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    write_figure(lambda: draw_branches(branches), folder / f"branch{tail}", look)
    (folder / f"branch{tail}.md").write_text(_caption(rig, branches), encoding="utf-8")
    return branches


def _born(branch: Branch, bounds: tuple[float, float], landing: Landing | None, progress: Callable[[str], None]) -> list[Branch]:
    """The branches that are born from one by period doubling; where no orbit is found, none."""
    found = []
    for place in branch.special:
        if place.kind is Kind.PERIOD_DOUBLING:
            progress(f"following {2 * branch.cycles} cycles from the period doubling at {place.parameter:.6g}")
            try:
                orbit = doubled(place, branch.name, bounds[1] - bounds[0], landing=landing)
                found.append(follow(orbit, branch.name, bounds, born_at=place, landing=landing))
            except NoConvergenceError as error:
                progress(str(error))
    return found


def borders_and_write(
    branch: Branch,
    along: str,
    bounds: tuple[Bounds, Bounds],
    folder: Path,
    *,
    tail: str = "",
    look: FigureStyle = SCREEN,
    progress: Callable[[str], None] = lambda stage: None,
) -> tuple[list[Border], list[str]]:
    """Follow the special points of a branch in a second parameter, and write `borders.csv`, the figure and its caption `borders.md`.

    Arguments:
        branch: as `follow_and_write` returns it.
        along: name of the second parameter.
        bounds: of the branch's parameter and of the second one, SI.
        folder: that exists.
        tail: of the files' names.
        look: sizes of the figure.
        progress: called with each stage.

    Returns:
        The borders, and a sentence on each special point from which none could be followed.
    """
    found, lost = borders(branch, along, bounds, progress=progress)
    if not found:
        return found, lost
    (folder / f"borders{tail}.csv").write_text(border_table(found), encoding="utf-8")
    write_figure(lambda: draw_borders(found), folder / f"borders{tail}", look)
    rig = branch.special[0].orbit.rig
    shown = "Curves in the plane of two parameters along which periodic orbits fold, double their period or graze the stop."
    rows = _rows(rig, dict(zip(found[0].names, bounds, strict=True)))
    text = written("borders of periodic motion", shown, borders_finding(found), rows)
    (folder / f"borders{tail}.md").write_text(text, encoding="utf-8")
    return found, lost


def _caption(rig: ForcedRig, branches: list[Branch]) -> str:
    branch = branches[0]
    rows = _rows(rig, {branch.name: (float(branch.parameter.min()), float(branch.parameter.max()))})
    cycles = "1 cycle" if branch.cycles == 1 else f"{branch.cycles} cycles"
    shown = (
        "Largest displacement u of the hammer relative to the cart, and largest impact force F_i or impact speed, of the periodic "
        f"orbits of {cycles} of excitation on one branch. Solid: stable; broken: unstable."
    )
    if len(branches) > 1:
        shown += " The other colours: branches born by period doubling."
    return written("branch of periodic motion", shown, "; ".join(map(branch_finding, branches)), rows)


def _rows(rig: ForcedRig, varied: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """The rig and its drive, with the ranges of what is varied."""
    settings = {"gap": (1e3, "mm"), "amplitude": (1e3, "mm"), "frequency": (1.0, "Hz")}
    words = {}
    for name in (*settings, *varied):
        scale, unit = settings.get(name, (1.0, rig.unit(name)))
        value = " to ".join(f"{scale * end:.4g}" for end in varied.get(name, (float(rig.value(name)),)))
        words[name] = f"{value} {unit}".removesuffix(" 1")
    drive = f"y = A0 sin(Omega t), Omega {words['frequency']}"
    rows = {"model": rig_words(model_document(rig.model)), "gap": words["gap"], "A0": words["amplitude"], "drive": drive}
    return rows | {name: words[name] for name in varied if name not in settings} | {"made with": f"vibrojax {__version__}"}


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


def draw_branches(branches: list[Branch]) -> Figure:
    """Two panels over the parameter: largest relative displacement, and peak force (impact speed where the stop is rigid).

    Make it within `vibrojax.drawing.style`.

    Arguments:
        branches: along the same parameter, one colour each.
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
    above.set_ylabel("largest $u$ (mm)")
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
