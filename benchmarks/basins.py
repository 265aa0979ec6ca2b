"""`python -m benchmarks.basins --json FILE`: shares of basins beside an independent computation by SciPy.

Initial states are drawn at random from a rectangle, other ones for each side: many for `vibrojax` (the batch engine and
`vibrojax.studies.attractors`), fewer for SciPy's DOP853 (`benchmarks.oracle`, and a Duffing oscillator written out here), whose motions
are called settled when a period of up to 8 cycles repeats to 1e-5, and sorted by z = p/q and the place of their section points. A share
agrees when it differs by less than three standard errors of the difference. SciPy's initial states are also run by `vibrojax`: how many
of them end on the same attractor.
"""

import argparse
import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from benchmarks import oracle
from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

_CLOSED, _SAME, _LONGEST = 1e-5, 5e-3, 8
"""Distances over A0 and A0 Omega, of a period from the one before and of one attractor's section from another's; cycles."""
_CYCLES = (160, 640, 3000)
"""Integrated from the start, each time anew, until the motion repeats."""
WORST = 3.0
"""Standard errors by which two shares may differ."""

Strobes = Callable[[float, float, int], tuple[np.ndarray, np.ndarray]]
"""(u, u', cycles) to section points, (cycles + 1, 2), and touches in each cycle."""


class Case(NamedTuple):
    """A rig, a rectangle of initial states, and the same rig for SciPy."""

    name: str
    u0: tuple[float, float]
    v0: tuple[float, float]
    setting: dict[str, float]
    """Of `vibrojax.batch`."""
    model: Callable[[], Any]
    strobes: Strobes


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.basins", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scipy", type=int, default=200, metavar="N", help="initial states for SciPy")
    parser.add_argument("--count", type=int, default=10000, metavar="N", help="initial states for vibrojax")
    parser.add_argument("--cases", nargs="*", default=list(CASES), choices=list(CASES), help="which")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    prepare_jax()
    console, found = Console(), {}
    for name in options.cases:
        with console.status("starting") as status:
            found[name] = compared(CASES[name], options.scipy, options.count, options.seed, status.update)
        _show(found[name], CASES[name], console)
    worst = max(row["standard_errors"] for case in found.values() for row in case["attractors"])
    console.print(f"largest difference of two shares: {worst:.1f} standard errors")
    if options.json is not None:
        report = {"cases": found, "worst_standard_errors": worst, "seed": options.seed, "machine": machine()}
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if worst < WORST else 1)


def compared(case: Case, few: int, many: int, seed: int, progress: Callable[[str], None] = lambda stage: None) -> dict[str, Any]:
    """Shares of every attractor by both, and on how many of SciPy's initial states they agree."""
    theirs_at, ours_at = (_drawn(case, count, [seed, side]) for side, count in enumerate((few, many)))
    theirs = []
    for start in theirs_at:
        theirs.append(_settled(case, *start))
        progress(f"{case.name}: {len(theirs)} of {few} motions by SciPy")
    label, ours = _ours(case, np.concatenate([ours_at, theirs_at]))
    scale = _scale(case)
    reference = [_index(one, ours, scale) for one in theirs]
    rows = []
    for number in sorted({*reference, *range(len(ours))}):
        counts = np.sum(label[:many] == number), sum(index == number for index in reference)
        shares = counts[0] / many, counts[1] / few
        pooled = (counts[0] + counts[1]) / (many + few)
        error = math.sqrt(pooled * (1 - pooled) * (1 / many + 1 / few))
        rows.append(
            {
                "attractor": ours[number].name if number >= 0 else "none of vibrojax's",
                "vibrojax": shares[0],
                "scipy": shares[1],
                "standard_errors": abs(shares[0] - shares[1]) / error if error > 0 else 0.0,
            }
        )
    same = sum(int(a == b) for a, b in zip(label[many:], reference, strict=True))
    return {"attractors": rows, "vibrojax_states": many, "scipy_states": few, "same_attractor": same}


def _drawn(case: Case, count: int, seed: list[int]) -> np.ndarray:
    low, high = np.array([case.u0, case.v0]).T
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def _scale(case: Case) -> np.ndarray:
    amplitude = case.setting["base_amplitude"]
    return np.array([amplitude, amplitude * 2 * np.pi * case.setting["frequency_hz"]])


def _ours(case: Case, starts: np.ndarray) -> tuple[np.ndarray, list[Any]]:
    """Attractor of each initial state, and the attractors, by `vibrojax`."""
    from vibrojax.batch import Points
    from vibrojax.studies.attractors import Sections, attractors, settled

    values = case.setting | {"u0": starts[:, 0], "v0": starts[:, 1]}
    found, kind, growth = settled(case.model(), Points(coords={"start": np.arange(float(len(starts)))}, values=values))
    section = np.stack([found.u, found.v], axis=-1) / _scale(case)
    return attractors(Sections(section, kind.kind, kind.impacts, kind.period, growth))


def _settled(case: Case, u: float, v: float) -> tuple[int, np.ndarray]:
    """Touches in one period, and its section points over their scale, by SciPy; none where no period is seen."""
    for cycles in _CYCLES:
        section, touches = case.strobes(u, v, cycles)
        section = section / _scale(case)
        for q in range(1, _LONGEST + 1):
            if np.abs(section[-q:] - section[-2 * q : -q]).max() < _CLOSED:
                return int(touches[-q:].sum()), section[-q:]
    return 0, np.zeros((0, 2))


def _index(one: tuple[int, np.ndarray], ours: list[Any], scale: np.ndarray) -> int:
    """Number of the attractor that SciPy's motion is on; -1 where it is none of them; a motion without period is the chaotic one."""
    touches, section = one
    for number, other in enumerate(ours):
        if not len(section) and other.period == 0:
            return number
        if len(section) and (touches, len(section)) == (other.impacts, other.period):
            shifted = [np.abs(np.roll(section, shift, axis=0) - other.points).max() for shift in range(len(section))]
            if min(shifted) < _SAME:
                return number
    return -1


MASS, ZETA, F_N, K_I, N, LAMBDA_I, GAP, AMPLITUDE = 0.5, 0.03, 5.0, 1e6, 1.5, 1.5, 4e-3, 1.5e-3


def _impact_model() -> Any:
    from vibrojax.contact import HuntCrossley
    from vibrojax.model import Model
    from vibrojax.suspension import Linear

    return Model(MASS, Linear(ZETA, F_N), HuntCrossley(K_I, N, LAMBDA_I))


def _impacting(frequency: float) -> Strobes:
    rig = oracle.Rig(
        mass=MASS,
        zeta=ZETA,
        f_n=F_N,
        gap=GAP,
        base_amplitude=AMPLITUDE,
        frequency_hz=frequency,
        force=oracle.hunt_crossley(K_I, N, LAMBDA_I),
    )

    def strobes(u: float, v: float, cycles: int) -> tuple[np.ndarray, np.ndarray]:
        ts = np.arange(cycles + 1) / frequency
        found = oracle.motion(rig, ts, (u, v), longest_step=1e-2, rtol=1e-8)
        touches, _ = np.histogram([impact.t for impact in found.impacts], bins=ts)
        return np.stack([found.u, found.v], axis=1), touches

    return strobes


D, BETA, F, OMEGA = 0.2, 1.0, 27.0, 2.2
"""Of x'' + d x' + beta x + x^3 = f cos(omega t), as in DynamicalSystems.jl's predefined `duffing`."""


def _duffing_model() -> Any:
    from vibrojax.contact import NoContact
    from vibrojax.effects import CubicStiffness
    from vibrojax.model import Model
    from vibrojax.suspension import Linear

    omega_n = math.sqrt(BETA)
    return Model(1.0, Linear(D / (2 * omega_n), omega_n / (2 * math.pi)), NoContact(), effects=(CubicStiffness(1.0),))


def _duffing(u: float, v: float, cycles: int) -> tuple[np.ndarray, np.ndarray]:
    ts = 2 * np.pi / OMEGA * np.arange(cycles + 1)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], F * math.cos(OMEGA * t) - D * y[1] - BETA * y[0] - y[0] ** 3]

    found = solve_ivp(rates, (0.0, ts[-1]), [u, v], method="DOP853", t_eval=ts, rtol=1e-10, atol=1e-10)
    return found.y.T, np.zeros(cycles, dtype=int)


_STRIKES = {"gap": GAP, "base_amplitude": AMPLITUDE}
CASES = {
    "duffing": Case(
        "Duffing oscillator, d = 0.2, beta = 1, f = 27, omega = 2.2",
        (-5.0, 5.0),
        (-10.0, 10.0),
        {"frequency_hz": OMEGA / (2 * math.pi), "base_amplitude": F / OMEGA**2, "base_phase": math.pi / 2, "gap": 1e3},
        _duffing_model,
        _duffing,
    ),
    "impact_8": Case(
        "impact oscillator, 8 Hz", (-8e-3, 4e-3), (-0.5, 0.3), _STRIKES | {"frequency_hz": 8.0}, _impact_model, _impacting(8.0)
    ),
    "impact_11": Case(
        "impact oscillator, 11 Hz", (-8e-3, 4e-3), (-0.5, 0.3), _STRIKES | {"frequency_hz": 11.0}, _impact_model, _impacting(11.0)
    ),
}


def _show(found: dict[str, Any], case: Case, console: Console) -> None:
    table = Table("attractor", "vibrojax", "SciPy", "standard errors apart", title=case.name)
    for row in found["attractors"]:
        ours, theirs = (f"{100 * row[name]:.1f} %" for name in ("vibrojax", "scipy"))
        table.add_row(row["attractor"], ours, theirs, f"{row['standard_errors']:.1f}")
    console.print(table)
    few, many = found["scipy_states"], found["vibrojax_states"]
    console.print(f"{many} and {few} initial states; of SciPy's, {found['same_attractor']} end on the same attractor with both")


if __name__ == "__main__":
    main()
