"""From a rig to files: settle, shoot, follow, write."""

import json
from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np

from vibrojax import __version__
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.branch import Branch
from vibrojax.continuation.figure import draw
from vibrojax.continuation.follow import follow
from vibrojax.continuation.orbit import find_orbit, settle
from vibrojax.continuation.rig import SETTINGS, ForcedRig, check_settings
from vibrojax.errors import InputError
from vibrojax.integrate import Landing


def follow_and_write(
    rig: ForcedRig,
    name: str,
    bounds: tuple[float, float],
    folder: Path,
    *,
    at: float,
    start: tuple[float, float] = (0.0, 0.0),
    landing: Landing | None = None,
    progress: Callable[[str], None] = lambda stage: None,
) -> Branch:
    """Settle onto a stable orbit at one value of a parameter, follow its branch, and write `branch.csv`, `special.json`, `branch.png`.

    Arguments:
        rig: the rig.
        name: of the parameter.
        bounds: its range, SI.
        folder: that exists.
        at: value at which the rig settles.
        start: (u, u') from which it settles, m and m/s.
        landing: the integrator.
        progress: called with each stage.

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
    branch = follow(orbit, name, bounds, landing=landing)
    progress("writing")
    (folder / "branch.csv").write_text(branch.csv(), encoding="utf-8")
    document = {
        "parameter": name,
        "unit": rig.unit(name),
        "cycles": branch.cycles,
        "ends": [end.value for end in branch.ends],
        "special": branch.special_table(),
        "provenance": {
            "vibrojax": __version__,
            "jax": jax.__version__,
            "settings": {setting: float(rig.value(setting)) for setting in SETTINGS},
            "start": list(start),
            "at": at,
        },
    }
    (folder / "special.json").write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    draw([branch], folder / "branch.png")
    return branch
