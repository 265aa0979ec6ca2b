"""Attractors: where the motion from each initial state settles, which motions share one, and where several coexist near by.

Attractors.jl finds attractors by recurrences: it marks the cells of a grid that a trajectory visits, one initial state after the other, and
the next trajectory stops where it meets marks. Here all initial states are integrated side by side, so that marks of one save the others
nothing; and an orbit that has closed to 1e-9 of A0 has recurred more surely than one that came back to a cell. So every motion is
integrated until it repeats or its time is over, and the sections of all are compared afterwards.

Source: G. Datseris, A. Wagemakers, Effortless estimation of basins of attraction, Chaos 32 (2022) 023104, for the recurrences; grouping
ours.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import jax
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from scipy.stats import binomtest

from vibrojax.batch import Points, Responses, Span, integrate
from vibrojax.batch.points import section_scales
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.base import APERIODIC, CHAOS, FAILED, LONGEST, NO_IMPACT, Kind, classify
from vibrojax.studies.lyapunov import exponents

SAME = 1e-3
"""Periodic sections that lie nearer to one another, over A0 and A0 Omega, are one: the resolution, as the cell size of Attractors.jl is."""
_CLOUD = 256
"""Section points at most that are kept of what does not repeat."""


class Sections(NamedTuple):
    """What is known of each settled motion, one row a lane."""

    points: np.ndarray
    """Last section points, u over A0 and u' over A0 Omega, `(lanes, strobes, 2)`."""
    kind: np.ndarray
    """A key of `base.KINDS`."""
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
    """A key of `base.KINDS`."""
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
    groups = sorted(_groups(lanes), key=lambda group: -group.size)
    label = np.full(len(lanes.kind), -1)
    for number, group in enumerate(groups):
        label[group] = number
    return label, _named([_described(lanes, group) for group in groups])


def share(count: int, total: int) -> tuple[float, float, float]:
    """Share of lanes, NaN of none, and its 95 % interval, as of initial states drawn at random (Wilson 1927); a regular grid errs less.

    Example:
        >>> [round(part, 3) for part in share(50, 100)]
        [0.5, 0.404, 0.596]
    """
    if total == 0:
        return float("nan"), float("nan"), float("nan")
    interval = binomtest(count, total).proportion_ci(method="wilson")
    return count / total, float(interval.low), float(interval.high)


def _orbit_distance(orbits: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Largest distance of corresponding section points, `(lanes, period, 2)` and `(period, 2)`, at the shift at which it is least."""
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
            near = _orbit_distance(orbits, orbits[0]) < SAME
            yield left[near]
            left = left[~near]
    wild = through & ~repeats & (lanes.kind == APERIODIC) & (np.nan_to_num(lanes.lyapunov, nan=0.0) > CHAOS)
    if wild.any():
        index = np.flatnonzero(wild)
        pieces = _pieces(lanes.points[index])
        yield from (index[pieces == number] for number in range(pieces.max() + 1))
    if (rest := through & ~repeats & ~wild).any():
        yield np.flatnonzero(rest)


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
    letters = [f" {_letter(names[:place].count(name))}" if names.count(name) > 1 else "" for place, name in enumerate(names, 1)]
    return [one._replace(name=one.name + letter) for one, letter in zip(found, letters, strict=True)]


def _letter(number: int) -> str:
    """1 is a, 26 z, 27 aa."""
    text = ""
    while number:
        number, rest = divmod(number - 1, 26)
        text = chr(ord("a") + rest) + text
    return text


_GROWS = 2
"""Each time that motions are integrated on, so many times as long as before."""
_SLOWEST = 0.999
"""Closing errors that shrink by less in a period are not extrapolated."""
_KIND, _IMPACTS, _PERIOD = (Kind._fields.index(name) for name in ("kind", "impacts", "period"))
_KEPT = ("u", "v", "impacts", "peak_force", "impact_speed", "u_max", "closed", "cycles", "result")


def settled(
    model: Model,
    points: Points,
    *,
    span: Span | None = None,
    most_cycles: int | None = None,
    lyapunov_cycles: int = 200,
    threads: int | None = None,
) -> tuple[Responses, Kind, np.ndarray]:
    """Integrate until each motion repeats, or `most_cycles` are over.

    A motion has settled when its last period repeats the one before to 1e-5 of A0, and what is left of its way, its closing errors summed
    as a geometric series, is less than half of `attractors.SAME`. Motions that have not are integrated on, each time for twice as long: an
    orbit of small damping, and chaos that dies out.

    Arguments:
        model: the rig.
        points: where.
        span: of the first stretch.
        most_cycles: after which a motion that has not settled counts as one that does not; by default ten times the first stretch.
        lyapunov_cycles: over which the exponent of a motion that does not repeat is averaged.
        threads: chunks of lanes at a time; by default one a core.

    Returns:
        The batch with the last cycles of every motion, its kind, and the Lyapunov exponent per cycle of what does not repeat, else NaN.
    """
    span, values = span or Span(), points.flat()
    most = 10 * (span.transient + span.recorded) if most_cycles is None else most_cycles
    found = integrate(model, points.chosen(np.arange(points.lanes)), span=span, threads=threads)
    kept = {name: np.array(getattr(found, name)) for name in _KEPT}
    kind, state = [np.array(part) for part in _kind(found, values)], found.state
    after, length = span.transient + span.recorded, span.transient
    while after < most and (left := np.flatnonzero(_open(kept, kind[_PERIOD], values))).size:
        length = min(max(_GROWS * length, 1), most - after)
        further = dataclasses.replace(span, transient=length)
        points_left, begin = points.chosen(left), jax.tree.map(lambda leaf, left=left: leaf[left], state)
        more = integrate(model, points_left, span=further, start=begin, threads=threads)
        for name, part in kept.items():
            part[left] = getattr(more, name) + (part[left] if name == "cycles" else 0)
        for part, new in zip(kind, _kind(more, points_left.values), strict=True):
            part[left] = new
        state = jax.tree.map(lambda old, new, left=left: old.at[left].set(new), state, more.state)
        after += length + span.recorded
    _shorten(kept, kind, values)
    growth, wild = np.full(points.lanes, np.nan), kind[_KIND] == APERIODIC
    if wild.any() and lyapunov_cycles > 0:
        growth[wild] = exponents(model, points, state, wild, cycles=lyapunov_cycles, threads=threads)[:, 0]
    shaped = {name: part.reshape(*points.shape, *part.shape[1:]) for name, part in kept.items()}
    last = Responses(coords=dict(points.coords), state=state, engine=found.engine, seconds=found.seconds, **shaped)
    return last, Kind(*(part.reshape(points.shape) for part in kind)), growth.reshape(points.shape)


def _kind(found: Responses, values: Mapping[str, np.ndarray]) -> Kind:
    return classify(found, values["base_amplitude"], values["frequency_hz"])


def _shorten(kept: Mapping[str, np.ndarray], kind: list[np.ndarray], values: Mapping[str, np.ndarray]) -> None:
    """Give each orbit its shortest period to within `SAME`: a transient that rings at half the drive repeats after two cycles first."""
    points, impacts, full = _scaled(kept, values), kept["impacts"], kind[_PERIOD].copy()
    for q in range(min(LONGEST, points.shape[1] // 2), 1, -1):
        for part in (part for part in range(q - 1, 0, -1) if q % part == 0):
            here = np.flatnonzero(full == q)
            back = slice(-q - part, -part)
            alike = np.abs(points[here, -q:] - points[here, back]).max(axis=(1, 2), initial=0.0) < SAME
            alike &= (impacts[here, -q:] == impacts[here, back]).all(axis=1)
            kind[_IMPACTS][here[alike]] = impacts[here[alike], -part:].sum(axis=1)
            kind[_PERIOD][here[alike]] = part


def _scaled(kept: Mapping[str, np.ndarray], values: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.stack([kept["u"], kept["v"]], axis=-1) / section_scales(values["base_amplitude"], values["frequency_hz"]).T[:, None, :]


def _open(kept: Mapping[str, np.ndarray], period: np.ndarray, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which lanes have not settled: no period, or more of the way left than half of `SAME`."""
    points = _scaled(kept, values)
    far = period == 0
    for q in range(1, points.shape[1] // 3 + 1):
        here = period == q
        if here.any():
            steps = np.abs(points[here, q:] - points[here, :-q]).max(axis=2)
            last, before = steps[:, -q:].max(axis=1), steps[:, -2 * q : -q].max(axis=1)
            ratio = np.minimum(last / np.maximum(before, np.finfo(float).tiny), _SLOWEST)
            far[here] = last * ratio / (1.0 - ratio) > 0.5 * SAME
    return far & (kept["closed"] == 0) & (kept["result"] == SUCCESS)


_FACTORS = np.geomspace(2.0**-0.5, 2.0**0.5, 21)
_STARTS = 4
"""Initial states along each axis."""
_WIDER = 1.5
"""Times as wide as the picture: attractors may lie beyond it."""


class Place(NamedTuple):
    """A value of one setting, all others kept, at which motions settle differently."""

    setting: str
    """"gap" or "frequency_hz"."""
    value: float
    """SI."""
    names: tuple[str, ...]
    """Of the attractors that were seen."""


def places_of_coexistence(
    model: Model,
    *,
    u0: np.ndarray,
    v0: np.ndarray,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
) -> list[Place]:
    """The nearest gap and the nearest frequency, up to the square root of two away, at which periodic attractors are seen to coexist.

    Sixteen initial states around the given ones are integrated at each of 21 gaps (of 21 clearances up to A0 where the gap is 0) and 21
    frequencies. Motions that do not settle do not count.

    Arguments:
        model: the rig.
        u0: m; the ends matter.
        v0: m/s.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
    """
    low, high = (np.array([f(u0), f(v0)]) for f in (np.min, np.max))
    half = _WIDER * 0.5 * (high - low)
    ends = 0.5 * (high + low) - half, 0.5 * (high + low) + half
    starts = np.stack(np.meshgrid(*np.linspace(*ends, _STARTS).T), axis=-1).reshape(-1, 2)
    tried = {"gap": gap * _FACTORS if gap > 0 else base_amplitude * np.linspace(0.05, 1.0, 21), "frequency_hz": frequency_hz * _FACTORS}
    here = {"gap": gap, "frequency_hz": frequency_hz}
    settings = [here | {name: float(value)} for name, values in tried.items() for value in values]
    gaps, frequencies = (np.array([one[name] for one in settings])[:, None] for name in here)
    rigid = isinstance(model.law, AbstractInstantaneousLaw)
    u = np.minimum(starts[None, :, 0], gaps) if rigid else starts[None, :, 0]
    values = {"u0": u, "v0": starts[None, :, 1], "gap": gaps, "frequency_hz": frequencies, "base_amplitude": base_amplitude}
    points = Points(coords={"setting": np.arange(float(len(settings))), "start": np.arange(float(len(starts)))}, values=values)
    found, kind, growth = settled(model, points, most_cycles=0, lyapunov_cycles=0)
    places = []
    for number, setting in enumerate(settings):
        name = "gap" if number < len(tried["gap"]) else "frequency_hz"
        scale = section_scales(np.asarray(base_amplitude), np.asarray(setting["frequency_hz"]))
        section = np.stack([found.u[number], found.v[number]], axis=-1) / scale
        _, each = attractors(Sections(section, kind.kind[number], kind.impacts[number], kind.period[number], growth[number]))
        names = tuple(one.name for one in each if one.period > 0)
        if len(names) > 1:
            places.append(Place(name, setting[name], names))
    each = [[place for place in places if place.setting == name] for name in here]
    return [min(some, key=lambda place: abs(place.value - here[place.setting])) for some in each if some]
