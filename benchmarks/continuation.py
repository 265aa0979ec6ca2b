"""`python -m benchmarks.continuation`: folds beside the jumps of sweeps, Floquet multipliers beside finite differences of a reference map.

Folds: branches of periodic orbits are followed through the range of frequencies; a bifurcation sweep up and down (`vibrojax.studies`, exact
flight, no step shared with the continuation) must jump within one frequency step of every fold: on the way up at a fold where the stable
part of the branch ends towards higher frequencies, on the way down at the others. Multipliers: at orbits spread along each branch, stable
and unstable, the monodromy matrix beside central differences of the stroboscopic map of SciPy's DOP853 (`benchmarks.oracle`).
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks import oracle
from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

MASS, ZETA, F_N, K_I, N, LAMBDA_I, AMPLITUDE = 1.0, 0.05, 5.0, 1e6, 1.5, 0.3, 1e-3
_H = 1e-5
"""Step of the differences, over A0 and A0 Omega."""
WORST = 1e-3
"""Largest distance of a multiplier from its reference, over the largest multiplier there or 1."""


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.continuation", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--gaps", type=float, nargs="*", default=[2e-3, 3e-3], metavar="M", help="gaps, a branch each, m")
    parser.add_argument("--range", type=float, nargs=2, default=[4.5, 9.0], metavar="HZ", help="range of frequencies")
    parser.add_argument("--step", type=float, default=0.02, metavar="HZ", help="frequency step of the sweeps")
    parser.add_argument("--cycles", type=int, default=400, help="cycles at each frequency, fewer where an orbit closes")
    parser.add_argument("--orbits", type=int, default=12, help="orbits a branch whose multipliers are compared")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    prepare_jax()
    console, found = Console(), []
    for gap in options.gaps:
        branch, rig = _branch(gap, options.range)
        row = {"gap_m": gap, "folds": folds(branch, rig, options), "multipliers": multipliers(branch, rig, options.orbits)}
        found.append(row)
        _show(row, console)
    every = [fold["found"] for row in found for fold in row["folds"]]
    worst = max(orbit["distance"] for row in found for orbit in row["multipliers"])
    good = bool(every) and all(every) and worst < WORST
    console.print(f"{sum(every)} of {len(every)} folds lie within a step of {options.step} Hz of a jump; multipliers within {worst:.1e}")
    if options.json is not None:
        report = {"branches": found, "folds": len(every), "folds_found": sum(every), "worst_multiplier": worst, "machine": machine()}
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if good else 1)


def _branch(gap: float, bounds: list[float]) -> tuple[Any, Any]:
    """The branch from the orbit at the lowest frequency on."""
    from vibrojax.contact import HuntCrossley
    from vibrojax.continuation import ForcedRig, find_orbit, follow, settle
    from vibrojax.model import Model
    from vibrojax.suspension import Linear

    rig = ForcedRig(Model(MASS, Linear(ZETA, F_N), HuntCrossley(K_I, N, LAMBDA_I)), gap, AMPLITUDE, bounds[0])
    state, cycles = settle(rig, np.zeros(2))
    return follow(find_orbit(rig, state, cycles=cycles), "frequency", (bounds[0], bounds[1])), rig


def folds(branch: Any, rig: Any, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Every fold of a branch, and the nearest jump of the sweep that should meet it."""
    from vibrojax.batch import Span
    from vibrojax.continuation import Kind
    from vibrojax.studies import bifurcation

    places = [place.parameter for place in branch.special if place.kind is Kind.FOLD]
    low, high = options.range
    values = low + options.step * np.arange(round((high - low) / options.step) + 1)
    span = Span(transient=options.cycles, recorded=16)
    swept = bifurcation(rig.model, parameter="frequency_hz", values=values, base_amplitude=AMPLITUDE, span=span, gap=float(rig.gap))
    rows = []
    for place in places:
        direction = "up" if _ends_upwards(branch, place) else "down"
        jumped = np.flatnonzero(swept["jump"].sel(direction=direction).values == 1)
        step = options.step if direction == "up" else -options.step
        between = [sorted((float(values[i] - step), float(values[i]))) for i in jumped]
        nearest = min(between, key=lambda pair: abs(sum(pair) / 2 - place), default=[np.nan, np.nan])
        near = nearest[0] - options.step <= place <= nearest[1] + options.step
        rows.append({"fold_hz": place, "sweep": direction, "jump_between_hz": nearest, "found": bool(near)})
    return rows


def _ends_upwards(branch: Any, place: float) -> bool:
    """Whether the branch comes to a fold from below: its points beside the fold lie lower."""
    turn = np.flatnonzero(np.diff(np.sign(np.diff(branch.parameter)))) + 1
    nearest = turn[np.argmin(np.abs(branch.parameter[turn] - place))]
    return bool(branch.parameter[nearest] > branch.parameter[nearest - 1])


def multipliers(branch: Any, rig: Any, count: int) -> list[dict[str, Any]]:
    """Eigenvalues of the monodromy matrix beside those of differences of the reference map."""
    rows = []
    for index in np.unique(np.linspace(0, len(branch.parameter) - 1, count).astype(int)):
        frequency, state = float(branch.parameter[index]), branch.states[index]
        exact = np.linalg.eigvals(_differences(float(rig.gap), frequency, branch.cycles, state)).astype(complex)
        ours = np.asarray(branch.multipliers[index])
        apart = min(np.abs(ours - order).max() for order in (exact, exact[::-1]))
        distance = float(apart / max(1.0, np.abs(exact).max()))
        largest = exact[np.argmax(np.abs(exact))]
        row = {"frequency_hz": frequency, "touches": int(branch.touches[index]), "stable": bool(branch.stable[index])}
        rows.append(row | {"largest": [float(largest.real), float(largest.imag)], "distance": distance})
    return rows


def _differences(gap: float, frequency: float, cycles: int, state: np.ndarray) -> np.ndarray:
    """Jacobian of the reference's stroboscopic map."""
    force = oracle.hunt_crossley(K_I, N, LAMBDA_I)
    rig = oracle.Rig(mass=MASS, zeta=ZETA, f_n=F_N, gap=gap, base_amplitude=AMPLITUDE, frequency_hz=frequency, force=force)
    ts = np.array([0.0, cycles / frequency])

    def strobe(at: np.ndarray) -> np.ndarray:
        reached = oracle.motion(rig, ts, (float(at[0]), float(at[1])))
        return np.array([reached.u[-1], reached.v[-1]])

    steps = np.diag(_H * AMPLITUDE * np.array([1.0, 2 * np.pi * frequency]))
    return np.stack([(strobe(state + step) - strobe(state - step)) / (2 * step.sum()) for step in steps], axis=1)


def _show(row: dict[str, Any], console: Console) -> None:
    table = Table("fold (Hz)", "sweep", "jumps between (Hz)", "within a step", title=f"gap {1e3 * row['gap_m']:g} mm")
    for fold in row["folds"]:
        low, high = fold["jump_between_hz"]
        table.add_row(f"{fold['fold_hz']:.6f}", fold["sweep"], f"{low:.3f} and {high:.3f}", "yes" if fold["found"] else "NO")
    console.print(table)
    table = Table("frequency (Hz)", "impacts", "stable", "largest multiplier", "distance")
    for orbit in row["multipliers"]:
        number = f"{complex(*orbit['largest']):.4f}"
        table.add_row(f"{orbit['frequency_hz']:.4f}", str(orbit["touches"]), str(orbit["stable"]), number, f"{orbit['distance']:.1e}")
    console.print(table)


if __name__ == "__main__":
    main()
