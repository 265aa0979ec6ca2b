"""Which numbers of the thesis's rigs meet the facts that its front matter states: all of them searched, each fact left out in turn.

    python -m benchmarks.preset_search --json preset-search.json

For every set of numbers (f_n, e, zeta, gap/A0 and how A0 changes with frequency) the bands z = 1/n of a rigid stop are known in closed form
(`vibrojax.presets.single_impact`); a fact is met where its place lies within one step of the experiment's grid of what is stated.
Coexistence is asked of the compliant rig by brute force, on a grid of restitution and damping: starts around the stop are run for 1500 and
for 3000 cycles, and a point is met where some strike the stop at both times, as many as before, and the motion without impacts stays off
it.
"""

import dataclasses
import itertools
import json
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from jaxtyping import Bool, Float
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.batch import Points, Span, integrate
from vibrojax.cli.environment import prepare_jax
from vibrojax.contact import KelvinVoigtClipped
from vibrojax.data_files import data_path
from vibrojax.model import Model
from vibrojax.presets.facts import GRID_HZ, fits_labels
from vibrojax.presets.preset import clipped_dashpot
from vibrojax.suspension import Linear

RESTITUTIONS = (0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9)
DAMPINGS = (0.005, 0.01, 0.015, 0.02, 0.03)
_SIDE, _CYCLES = 5, 1484
_STIFFNESS, _AMPLITUDE, _FREQUENCY = 1e7, 1.79e-4, 1.82
"""N/m of a mass of 1 kg, A0 in m, f_n in Hz: an impact lasts 0.2 % of a cycle, as in the presets."""
RIGS = ("wires", "beam_170", "beam_150", "beam_135")
_WAYS: dict[str, Any] = dict(gap_ratio=np.geomspace(1.5, 12.0, 22), power=(-2.0, -1.0, 0.0, 1.0))
REFERENCE_HZ = 3.0
"""Where gap/A0 is that of a set; elsewhere A0 goes with a power of the frequency."""
_AT_ONCE = 2000
"""Sets, for the sake of memory."""
_RATIOS = np.linspace(1.05, 5.2, 700)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sets:
    """Sets of numbers, one a row.

    Attributes:
        natural_frequency: f_n, Hz.
        restitution: e.
        damping_ratio: zeta.
        gap_ratio: gap/A0 at 3 Hz; 0 where the gap is.
        power: p of A0 ~ f^p: 0 constant displacement, -1 velocity, -2 acceleration.
    """

    natural_frequency: Float[np.ndarray, " sets"]
    restitution: Float[np.ndarray, " sets"]
    damping_ratio: Float[np.ndarray, " sets"]
    gap_ratio: Float[np.ndarray, " sets"]
    power: Float[np.ndarray, " sets"]


def every_set(**axes: Sequence[float] | np.ndarray) -> Sets:
    """Every combination of the values of each number."""
    mesh = np.meshgrid(*(np.asarray(values, float) for values in axes.values()), indexing="ij")
    return Sets(**{name: part.ravel() for name, part in zip(axes, mesh, strict=True)})


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bands:
    """Of each set: frequency of the largest impact speed on the stable band z = 1/n, and the band's upper end, Hz; NaN without a band."""

    largest: Float[np.ndarray, " sets"]
    end: Float[np.ndarray, " sets"]


def bands(sets: Sets, cycles: int, *, gap: bool) -> Bands:
    """The band z = 1/n of every set.

    Arguments:
        sets: numbers.
        cycles: n.
        gap: whether the rig has the gap of the sets, or none.
    """
    ratio = _RATIOS[(_RATIOS > 1.0) & (_RATIOS < 2.75 * cycles)]
    largest, end = np.full(len(sets.power), np.nan), np.full(len(sets.power), np.nan)
    for begin in range(0, len(sets.power), _AT_ONCE):
        rows = slice(begin, begin + _AT_ONCE)
        f_n = sets.natural_frequency[rows, None]
        amplitude = (ratio * f_n / REFERENCE_HZ) ** sets.power[rows, None]
        clearance = sets.gap_ratio[rows, None] / amplitude if gap else np.zeros_like(amplitude)
        speed, stable = motion(ratio, clearance, sets.damping_ratio[rows, None], sets.restitution[rows, None], cycles)
        force = np.where(stable, speed * amplitude, np.nan)
        first = _seed(stable, ratio, cycles, gap=gap)
        inside = _stretch(stable, first)
        found = inside.any(axis=1)
        top = np.argmax(np.where(inside, np.nan_to_num(force, nan=-1.0), -1.0), axis=1)
        last = inside.shape[1] - 1 - np.argmax(inside[:, ::-1], axis=1)
        largest[rows] = np.where(found, ratio[top] * f_n[:, 0], np.nan)
        end[rows] = np.where(found, ratio[last] * f_n[:, 0], np.nan)
    return Bands(largest=largest, end=end)


def motion(
    ratio: np.ndarray, clearance: np.ndarray, zeta: np.ndarray, restitution: np.ndarray, cycles: int
) -> tuple[np.ndarray, np.ndarray]:
    """Impact speed over A0 omega_n of z = 1/n, and whether the motion is stable; `SingleImpact` on arrays.

    Example:
        >>> speed, stable = motion(np.array([2.0]), np.array([0.0]), np.array([0.01]), np.array([0.75]), 1)
        >>> round(float(speed[0]), 2), bool(stable[0])
        (19.22, True)
    """
    omega = np.sqrt(1.0 - zeta**2)
    time = 2.0 * np.pi * cycles / ratio
    decay, cosine, sine = np.exp(-zeta * time), np.cos(omega * time), np.sin(omega * time) / omega
    a, b, d = decay * (cosine + zeta * sine), decay * sine, decay * (cosine - zeta * sine)
    determinant = (a - 1.0) * (d - 1.0) + b**2
    alpha, beta = -(1.0 + restitution) * b / determinant, (1.0 + restitution) * (a - 1.0) / determinant
    real, imaginary = 1.0 - ratio**2, 2.0 * zeta * ratio
    forced = ratio**2 / np.hypot(real, imaginary)
    rate = (restitution + beta) / ratio
    square = alpha**2 + rate**2
    root = (alpha * clearance) ** 2 - square * (clearance**2 - forced**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        speed = np.where(root >= 0, (alpha * clearance + np.sqrt(root)) / square, np.nan)
        angle = np.arctan2(clearance - alpha * speed, -rate * speed)
        push = ratio**2 * np.sin(angle + np.arctan2(imaginary, real)) - clearance
        turned = (push * (1.0 + restitution)) / speed
        trace = -restitution * (a + d) + turned * b
    stable = (speed > 0) & (np.abs(trace) < 1.0 + restitution**2 * decay**2)
    return speed, stable


def _seed(stable: Bool[np.ndarray, "sets ratio"], ratio: np.ndarray, cycles: int, *, gap: bool) -> np.ndarray:
    """A place inside the band: at gap 0 below r = 2 n, else the last stable place below it; -1 without one."""
    allowed = stable & (ratio < (0.98 if gap else 1.0) * 2.0 * cycles + (0.0 if gap else 1e-9))
    last = allowed.shape[1] - 1 - np.argmax(allowed[:, ::-1], axis=1)
    return np.where(allowed.any(axis=1), last, -1)


def _stretch(stable: Bool[np.ndarray, "sets ratio"], seed: np.ndarray) -> Bool[np.ndarray, "sets ratio"]:
    """The stable places joined to the seed without a break."""
    place = np.arange(stable.shape[1])[None, :]
    broken = ~stable
    below = np.max(np.where(broken & (place < seed[:, None]), place, -1), axis=1)
    above = np.min(np.where(broken & (place > seed[:, None]), place, stable.shape[1]), axis=1)
    return (place > below[:, None]) & (place < above[:, None]) & (seed[:, None] >= 0)


def near(found: Float[np.ndarray, " sets"], stated: float) -> Bool[np.ndarray, " sets"]:
    """Whether a place lies within one step of the experiment's grid of what is stated."""
    return np.abs(found - stated) <= GRID_HZ


def coexists(sets: Sets, ratio: float, clearance: float) -> Bool[np.ndarray, " sets"]:
    """Whether z = 1/1 is stable at (Omega/omega, gap/A0), where the motion without impacts stays off the stop."""
    at, wide = np.full(len(sets.power), ratio), np.full(len(sets.power), clearance)
    return motion(at, wide, sets.damping_ratio, sets.restitution, 1)[1]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a search found.

    Attributes:
        most: largest number of facts that one set meets.
        best: rows of the sets that meet so many.
        alone: by fact, whether any set meets it.
        left_out: by fact, share of the sets that are best on all others which meet it: how well the others predict it.
        conflicts: smallest groups, of two or three, of facts that are met each, but by no set together.
    """

    most: int
    best: np.ndarray
    alone: Mapping[str, bool]
    left_out: Mapping[str, float]
    conflicts: Sequence[tuple[str, ...]]


def outcome(met: Mapping[str, Bool[np.ndarray, " sets"]]) -> Outcome:
    """Count the facts that each set meets, leave each out in turn, and name the groups that contradict each other.

    Example:
        >>> met = {"a": np.array([True, True, False]), "b": np.array([True, False, False]), "c": np.array([False, False, True])}
        >>> found = outcome(met)
        >>> found.most, found.best.tolist(), found.conflicts, found.left_out["a"]
        (2, [0], [('a', 'c'), ('b', 'c')], 0.5)
    """
    table, names = np.stack(list(met.values())), list(met)
    total = table.sum(axis=0)
    left_out = {}
    for row, name in enumerate(names):
        others = total - table[row]
        left_out[name] = float(table[row][others == others.max()].mean())
    conflicts: list[tuple[str, ...]] = []
    for size in (2, 3):
        for group in itertools.combinations([row for row in range(len(names)) if table[row].any()], size):
            known = any(set(conflict) <= {names[row] for row in group} for conflict in conflicts)
            if not known and not table[list(group)].all(axis=0).any():
                conflicts.append(tuple(names[row] for row in group))
    return Outcome(
        most=int(total.max()),
        best=np.flatnonzero(total == total.max()),
        alone={name: bool(row.any()) for name, row in zip(names, table, strict=True)},
        left_out=left_out,
        conflicts=conflicts,
    )


def label_frequencies(labels: Sequence[float], low: float, high: float, step: float) -> list[float]:
    """Natural frequencies that the printed Omega/omega allow, Hz."""
    return [float(trial) for trial in np.arange(low, high, step) if fits_labels(float(trial), labels)]


def points(rig: str) -> list[tuple[float, float]]:
    """(Omega/omega, gap/A0) at which both motions are stated to exist."""
    table = "rig_wires" if rig == "wires" else "rig_beam"
    rows = {row["name"]: row["value"] for row in tomllib.loads(data_path("thesis", f"{table}.toml").read_text())["value"]}
    prefix = "basin_" if rig == "wires" else f"basin_{rig[-3:]}_"
    return [(rows[f"{prefix}{i}_frequency_ratio"], rows[f"{prefix}{i}_gap_ratio"]) for i in range(1, 7) if f"{prefix}{i}_gap_ratio" in rows]


def struck(ratio: float, clearance: float) -> np.ndarray:
    """How many of the starts strike after 1500 and after 3000 cycles, `(restitution, damping, 2)`."""
    gap = clearance * _AMPLITUDE
    reach = 4.0 * gap * 2.0 * np.pi * ratio * _FREQUENCY
    u, v = np.meshgrid(np.linspace(-4.0, 1.0, _SIDE) * gap, np.linspace(-reach, reach, _SIDE))
    dashpots = np.array([clipped_dashpot(e, _STIFFNESS, 1.0) for e in RESTITUTIONS])
    values = dict(
        lambda_i=dashpots[:, None, None],
        zeta=np.array(DAMPINGS)[None, :, None],
        u0=u.reshape(1, 1, -1),
        v0=v.reshape(1, 1, -1),
        frequency_hz=ratio * _FREQUENCY,
        gap=gap,
        base_amplitude=_AMPLITUDE,
    )
    grid = Points(coords={"e": np.array(RESTITUTIONS), "zeta": np.array(DAMPINGS), "start": np.arange(u.size)}, values=values)
    model = Model(1.0, Linear(0.01, _FREQUENCY), KelvinVoigtClipped(_STIFFNESS, 1e-5))
    first = integrate(model, grid, span=Span(transient=_CYCLES))
    second = integrate(model, grid, span=Span(transient=_CYCLES), start=first.state)
    return np.stack([(found.impacts.sum(axis=-1) > 0).sum(axis=-1) for found in (first, second)], axis=-1)


def lasting(counts: np.ndarray) -> np.ndarray:
    """Whether motion with impacts lasts: as many starts strike late as early, and some do."""
    return (counts[..., 1] > 0) & (counts[..., 0] == counts[..., 1])


def sets_of(rig: str) -> Sets:
    """The sets of numbers that are searched for a rig."""
    if rig == "wires":
        rows = tomllib.loads(data_path("thesis", "rig_wires.toml").read_text())["value"]
        labels = [row["value"] for row in rows if row["name"].startswith("compared")]
        f_n = label_frequencies(labels, 1.6, 2.2, 1e-3)[::6]
        return every_set(natural_frequency=f_n, restitution=RESTITUTIONS, damping_ratio=DAMPINGS, **_WAYS)
    f_n = np.arange(4.3, 4.8, 0.02) if rig == "beam_170" else [6.0]
    return every_set(natural_frequency=f_n, restitution=RESTITUTIONS, damping_ratio=DAMPINGS, gap_ratio=[1.0], power=[0.0])


def band_facts(rig: str, sets: Sets) -> dict[str, np.ndarray]:
    """Which sets meet each stated place of a band."""
    if rig == "wires":
        first, second = bands(sets, 1, gap=False), bands(sets, 2, gap=False)
        third, fourth = bands(sets, 1, gap=True), bands(sets, 2, gap=True)
        return {
            "gap 0: bifurcation at 4.75 Hz": near(first.end, 4.75),
            "gap 0: z = 1/2 largest at 7.25 Hz": near(second.largest, 7.25),
            "gap 0: transitory at 8.25 Hz": near(second.end, 8.25),
            "gap 0: transitory at 8.5 Hz": near(second.end, 8.5),
            "gap 1 mm: z = 1/1 largest at 3 Hz": near(third.largest, 3.0),
            "gap 1 mm: z = 1/2 largest at 6.25 Hz": near(fourth.largest, 6.25),
            "gap 1 mm: transitory at 7 Hz": near(fourth.end, 7.0),
        }
    if rig == "beam_170":
        found = bands(sets, 1, gap=False)
        return {"gap 0: largest at 9 Hz": near(found.largest, 9.0), "gap 0: transitory at 12.25 Hz": near(found.end, 12.25)}
    return {}


def summary(rig: str, counts: Mapping[tuple[float, float], np.ndarray], console: Console) -> dict[str, Any]:
    """Facts of one rig: met alone, together, and by sets that are best on all others."""
    sets = sets_of(rig)
    row = np.searchsorted(RESTITUTIONS, sets.restitution - 1e-9), np.searchsorted(DAMPINGS, sets.damping_ratio - 1e-9)
    met = band_facts(rig, sets) | {f"both motions at {point}": lasting(counts[point])[row] for point in points(rig)}
    simple = {f"both motions at {point}": bool(coexists(sets, *point).any()) for point in points(rig)}
    found = outcome(met)
    best = {name: [float(np.min(part[found.best])), float(np.max(part[found.best]))] for name, part in vars(sets).items()}
    pairs = sorted({(float(sets.restitution[i]), float(sets.damping_ratio[i])) for i in found.best})
    table = Table("fact", "any set", "best sets", "predicted by the others", "z = 1/1 there", title=f"{rig}: {len(sets.power)} sets")
    for name, part in met.items():
        share = f"{100 * float(part[found.best].mean()):.0f} %"
        one = "" if name not in simple else ("yes" if simple[name] else "no set")
        table.add_row(name, "yes" if found.alone[name] else "none", share, f"{100 * found.left_out[name]:.0f} %", one)
    console.print(table)
    console.print(f"{rig}: at most {found.most} of {len(met)} together, by {len(found.best)} sets; (e, zeta) {pairs}", soft_wrap=True)
    console.print(f"{rig}: among them {', '.join(f'{n} {a:.4g} to {b:.4g}' for n, (a, b) in best.items())}", soft_wrap=True)
    for conflict in found.conflicts:
        console.print(f"{rig}: no set meets {' and '.join(conflict)}", soft_wrap=True)
    return {
        "most": found.most,
        "of": len(met),
        "best": best,
        "pairs": pairs,
        "alone": dict(found.alone),
        "left_out": dict(found.left_out),
        "conflicts": [list(conflict) for conflict in found.conflicts],
    }


def main(json_file: Annotated[Path | None, typer.Option("--json", help="File for the result.")] = None) -> None:
    """Search, and print what was found for every rig."""
    prepare_jax()
    console, begin = Console(highlight=False, width=140), time.perf_counter()
    progress = Console(stderr=True, highlight=False)
    counts = {}
    for point in dict.fromkeys(itertools.chain.from_iterable(points(rig) for rig in RIGS)):
        counts[point] = struck(*point)
        progress.print(
            f"{time.perf_counter() - begin:7.1f} s  {point}: {int(lasting(counts[point]).sum())} of {counts[point][..., 0].size} sets"
        )
    found = {rig: summary(rig, counts, console) for rig in RIGS}
    common = sorted(set.intersection(*({float(e) for e, _ in found[rig]["pairs"]} for rig in RIGS[1:])))
    console.print(f"e that is best for all three couplings, each with its own zeta: {common or 'none'}", soft_wrap=True)
    if json_file is not None:
        document = {"rigs": found, "struck": {str(k): v.tolist() for k, v in counts.items()}, "machine": machine(), "common": common}
        json_file.write_text(json.dumps(document, indent=1, default=float) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
