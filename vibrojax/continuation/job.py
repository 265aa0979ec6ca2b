"""From a rig to files: settle, shoot, follow, write."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import jax
import numpy as np

from vibrojax import __version__
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.border import Border, Bounds, border_table, borders
from vibrojax.continuation.branch import Branch, Kind
from vibrojax.continuation.figure import borders_finding, branch_finding, draw_borders, draw_branches
from vibrojax.continuation.follow import doubled, follow
from vibrojax.continuation.orbit import find_orbit, settle
from vibrojax.continuation.rig import SETTINGS, ForcedRig, check_settings
from vibrojax.drawing import write_figure
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.figure_style import SCREEN, FigureStyle, rig_words, written
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
    landing: Landing | None = None,
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
        landing: the integrator.
        tail: of the files' names.
        look: sizes of the figure.
        progress: called with each stage.

    Returns:
        The borders, and a sentence on each special point from which none could be followed.
    """
    found, lost = borders(branch, along, bounds, landing=landing, progress=progress)
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
