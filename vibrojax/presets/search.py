"""Which numbers of a rig reproduce the stated facts together: a search over all of them, in closed form.

For every set of numbers (f_n, e, zeta, gap/A0 and how A0 changes with frequency) the bands z = 1/n of a rigid stop are known in closed form
(`vibrojax.presets.single_impact`). A fact is met where its place lies within one step of the experiment's grid of what is stated.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float

from vibrojax.presets.inference import GRID_HZ, fits_labels

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
