"""Attractors: motions that have settled share one where their section points lie in the same place.

Attractors.jl finds attractors by recurrences: it marks the cells of a grid that a trajectory visits, one initial state after the other, and
the next trajectory stops where it meets marks. Here all initial states are integrated side by side, so that marks of one save the others
nothing; and an orbit that has closed to 1e-9 of A0 has recurred more surely than one that came back to a cell. So every motion is
integrated until it repeats or its time is over, and the sections of all are compared afterwards.

Source: G. Datseris, A. Wagemakers, Effortless estimation of basins of attraction, Chaos 32 (2022) 023104, for the recurrences; grouping
ours.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from vibrojax.studies.base import CHAOS
from vibrojax.studies.classify import APERIODIC, FAILED, NO_IMPACT

SAME = 1e-3
"""Periodic sections that lie nearer to one another, over A0 and A0 Omega, are one: the resolution, as the cell size of Attractors.jl is."""
_CLOUD = 256
"""Section points at most that are kept of what does not repeat."""
CONFIDENCE = 1.96
"""Standard deviations of a 95 % interval."""


class Sections(NamedTuple):
    """What is known of each settled motion, one row a lane."""

    points: np.ndarray
    """Last section points, u over A0 and u' over A0 Omega, `(lanes, strobes, 2)`."""
    kind: np.ndarray
    """A key of `classify.KINDS`."""
    impacts: np.ndarray
    """p of z = p/q."""
    period: np.ndarray
    """q of z = p/q; 0 where the motion does not repeat."""
    lyapunov: np.ndarray
    """Exponent per cycle; NaN where it was not asked for."""


class Attractor(NamedTuple):
    """A place where motions settle."""

    name: str
    """Such as "z = 1/1"; those of one z are distinguished by a letter."""
    motion: str
    """The name without the letter."""
    kind: int
    """A key of `classify.KINDS`."""
    impacts: int
    period: int
    """0 of what does not repeat."""
    lyapunov: float
    """Median over its lanes; NaN of what repeats."""
    lanes: int
    """How many end here."""
    points: np.ndarray
    """Section points, u over A0 and u' over A0 Omega, `(points, 2)`: one period, or many of what does not repeat."""


def attractors(lanes: Sections) -> tuple[np.ndarray, list[Attractor]]:
    """Which attractor each lane is on, and the attractors, that of most lanes first.

    Periodic motions of the same p and q are one where their section points are within `SAME`. Chaotic motions are one where each section
    point's nearest neighbour among the other lanes is no farther than a neighbour within its own lane is: the points of all lanes together
    must not fall apart. What neither repeats nor is chaotic is one class, "not settled, or q > 8".

    Returns:
        A number for each lane, -1 where the integration failed, and the attractors by that number.

    Example:
        >>> still = np.zeros((3, 2, 2)) + np.array([0.0, 0.0, 5.0])[:, None, None]
        >>> one, zero = np.ones(3, int), np.zeros(3)
        >>> found, each = attractors(Sections(still, one, one, one, zero))
        >>> found.tolist(), [a.name for a in each]
        ([0, 0, 1], ['z = 1/1 a', 'z = 1/1 b'])
    """
    label, count = np.full(len(lanes.kind), -1), 0
    for group in _groups(lanes):
        label[group] = count
        count += 1
    sizes = np.bincount(label[label >= 0], minlength=count)
    order = np.argsort(-sizes, kind="stable")
    rank = np.empty(count, int)
    rank[order] = np.arange(count)
    label = np.where(label >= 0, rank[label] if count else label, -1)
    return label, _named([_described(lanes, np.flatnonzero(label == number)) for number in range(count)])


def share(count: int, total: int) -> tuple[float, float, float]:
    """Share of lanes, NaN of none, and its 95 % interval, as of initial states drawn at random (Wilson 1927); a regular grid errs less.

    Example:
        >>> [round(part, 3) for part in share(50, 100)]
        [0.5, 0.404, 0.596]
    """
    if total == 0:
        return float("nan"), float("nan"), float("nan")
    p, z2 = count / total, CONFIDENCE**2
    middle = (p + z2 / (2 * total)) / (1 + z2 / total)
    half = CONFIDENCE / (1 + z2 / total) * np.sqrt(p * (1 - p) / total + z2 / (4 * total**2))
    return p, float(min(max(middle - half, 0.0), p)), float(max(min(middle + half, 1.0), p))


def orbit_distance(orbits: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Largest distance of corresponding section points, at the shift at which it is least.

    Arguments:
        orbits: section points of one period each, `(lanes, period, 2)`.
        one: of the orbit that they are compared with, `(period, 2)`.
    """
    shifted = [np.abs(orbits - np.roll(one, shift, axis=0)).max(axis=(1, 2)) for shift in range(len(one))]
    return np.min(shifted, axis=0)


def _groups(lanes: Sections) -> Iterator[np.ndarray]:
    """Lanes of each attractor."""
    through = lanes.kind != FAILED
    repeats = through & (lanes.period > 0)
    impacts = np.where(lanes.kind == NO_IMPACT, 0, lanes.impacts)
    for p, q in np.unique(np.stack([impacts[repeats], lanes.period[repeats]], axis=1), axis=0):
        left = np.flatnonzero(repeats & (impacts == p) & (lanes.period == q))
        while left.size:
            orbits = lanes.points[left, -q:]
            near = orbit_distance(orbits, orbits[0]) < SAME
            yield left[near]
            left = left[~near]
    wild = through & ~repeats & is_chaotic(lanes)
    if wild.any():
        index = np.flatnonzero(wild)
        pieces = _pieces(lanes.points[index])
        yield from (index[pieces == number] for number in range(pieces.max() + 1))
    if (rest := through & ~repeats & ~wild).any():
        yield np.flatnonzero(rest)


def is_chaotic(lanes: Sections) -> np.ndarray:
    """Whether a lane that does not repeat has an exponent above zero."""
    return (lanes.kind == APERIODIC) & (np.nan_to_num(lanes.lyapunov, nan=0.0) > CHAOS)


def _pieces(points: np.ndarray) -> np.ndarray:
    """Number of the connected piece of each lane, in the graph of nearest neighbours of section points."""
    count, strobes, _ = points.shape
    if count == 1:
        return np.zeros(1, dtype=int)
    flat, owner = points.reshape(-1, 2), np.repeat(np.arange(count), strobes)
    reach = np.array([KDTree(own).query(own, k=2)[0][:, 1].max() for own in points])
    distance, index = (np.asarray(part) for part in KDTree(flat).query(flat, k=strobes + 1))
    foreign = np.where(owner[index] != owner[:, None], distance, np.inf)
    nearest = foreign.argmin(axis=1)
    rows = np.arange(len(flat))
    linked = foreign[rows, nearest] <= reach[owner]
    edges = owner[linked], owner[index[rows, nearest]][linked]
    graph = coo_matrix((np.ones(edges[0].size), edges), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _described(lanes: Sections, members: np.ndarray) -> Attractor:
    """An attractor without its letter."""
    first = members[0]
    kind, q = int(lanes.kind[first]), int(lanes.period[first])
    p = 0 if kind == NO_IMPACT else int(lanes.impacts[first]) if q else 0
    growth = lanes.lyapunov[members]
    growth = float(np.median(growth[np.isfinite(growth)])) if q == 0 and np.isfinite(growth).any() else float("nan")
    if q == 0:
        name = "chaotic" if growth > CHAOS else "not settled, or q > 8"
    elif kind == NO_IMPACT:
        name = "no impact" if q == 1 else f"no impact, q = {q}"
    else:
        name = f"z = {p}/{q}"
    points = lanes.points[first, -q:] if q else lanes.points[members].reshape(-1, 2)[:_CLOUD]
    return Attractor(name, name, kind, p, q, growth, members.size, points)


def _named(found: list[Attractor]) -> list[Attractor]:
    """Letters for those of the same name."""
    names = [one.name for one in found]
    seen: dict[str, int] = {}
    result = []
    for one in found:
        number = seen[one.name] = seen.get(one.name, 0) + 1
        several = names.count(one.name) > 1
        result.append(one._replace(name=f"{one.name} {_letter(number)}" if several else one.name))
    return result


def _letter(number: int) -> str:
    """1 is a, 26 z, 27 aa."""
    text = ""
    while number:
        number, rest = divmod(number - 1, 26)
        text = chr(ord("a") + rest) + text
    return text
