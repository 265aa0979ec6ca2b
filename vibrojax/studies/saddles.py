"""Saddle periodic orbits of the stroboscopic map, in and near a picture of the plane (u, u').

Points are measured in cells of the picture, so that every length (steps along a curve, errors, distances from a boundary) is a number of
cells. Candidates come from the picture; Newton's method goes on from all of them at once.
"""

import abc
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from vibrojax.batch import Points, Strobes, packed
from vibrojax.batch.points import lanes_of, state_at
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.orbit import Orbit, find_orbit
from vibrojax.continuation.rig import ForcedRig
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model

Plane = Float[np.ndarray, "points 2"]
"""One row a point; arguments and results of this type are of one length."""
Curve = Float[np.ndarray, "_ 2"]
"""Points of any number."""
Place = Float[np.ndarray, " 2"]


class AbstractPlaneMap(eqx.Module):
    """A continuous map of the plane, or of a part of it that ends at an edge."""

    @abc.abstractmethod
    def image(self, points: Plane) -> Plane:
        """Where the map takes each point, in cells; NaN where nowhere. A point beyond the edge is taken for that to which it is folded."""

    def fold(self, points: Plane) -> Plane:
        """The point of the plane that stands for each one beyond its edge; the others stay."""
        return points

    @property
    def edge(self) -> float:
        """Abscissa beyond which points are folded, in cells; infinite for a plane without edge."""
        return float("inf")


class StrobeMap(AbstractPlaneMap):
    """P^q: (u, u') when the cart passes its middle -> the same q cycles later.

    Behind a rigid stop there is no state. The plane is continued there by the states between which an impact jumps: u > gap with u' > 0
    stands for 2 gap - u with -e u', and with u' < 0 for 2 gap - u with the velocity before such a rebound. So a curve passes through
    an impact at the strobe without a break (Ivanov 1993 removes the jump by the same reflection).

    A contact law that depends on the speed of its touch has, in contact at the strobe, a state that (u, u') do not hold: |u'| stands for
    that speed, as for the initial states of a basin.

    Arguments:
        rig: model, gap, A0 and frequency.
        cycles: q.
        origin: (u, u') of the point (0, 0), m and m/s.
        cell: sides of a cell, m and m/s.

    Raises:
        InputError: an effect has a state of its own, so that states are no plane.
    """

    rig: ForcedRig
    strobes: Strobes
    cycles: int = eqx.field(static=True)
    origin: Place
    cell: Place

    def __init__(self, rig: ForcedRig, cycles: int, origin: Place, cell: Place):
        check_plane(rig.model)
        setting = {"frequency_hz": rig.frequency_hz, "gap": rig.gap, "base_amplitude": rig.base_amplitude}
        points = Points(coords={"lane": np.zeros(1)}, values=setting | {"u0": min(0.0, float(rig.gap))})
        self.rig, self.cycles, self.origin, self.cell = rig, cycles, origin, cell
        self.strobes = Strobes(lanes_of(rig.model, points)[0])

    def image(self, points: Plane) -> Plane:
        u, v = self.states(self.fold(points)).T
        systems = jax.tree.unflatten(self.strobes.form, list(self.strobes.rigs)).systems
        for _ in range(self.cycles if len(points) else 0):
            state, met = self.strobes.advance(np.zeros(len(u), int), packed(state_at(systems, jnp.asarray(u), jnp.asarray(v))), 1, 1)
            arrived = (met["result"] == SUCCESS) & np.isfinite(u) & np.isfinite(v)
            u, v = np.where(arrived, state[:2], np.nan)
        return (np.stack([u, v], axis=-1) - self.origin) / self.cell

    def states(self, points: Plane) -> Plane:
        """(u, u') of points, m and m/s."""
        return self.origin + points * self.cell

    def fold(self, points: Plane) -> Plane:
        law = self.rig.model.law
        if not isinstance(law, AbstractInstantaneousLaw):
            return points
        u, v = self.states(points).T
        gap, speed = float(self.rig.gap), np.abs(v)
        after = np.asarray(law.rebound_speed(jnp.asarray(speed)))
        before = speed**2 / np.where(after > 0, after, 1.0)
        mirrored = np.stack([2.0 * gap - u, np.where(v > 0, -after, before)], axis=-1)
        return np.where((u > gap)[:, None], (mirrored - self.origin) / self.cell, points)

    @property
    def edge(self) -> float:
        rigid = isinstance(self.rig.model.law, AbstractInstantaneousLaw)
        return float((float(self.rig.gap) - self.origin[0]) / self.cell[0]) if rigid else float("inf")


def check_plane(model: Model) -> None:
    """Raise `InputError` where an effect has a state of its own, so that states are no plane, or changes the law of a rigid stop."""
    names = [effect.name for effect in model.rig.effects if effect.own_states]
    if names:
        raise InputError(
            f"manifolds are asked for, and {', '.join(names)} has a state of its own: expected a model whose state is u and u', since "
            "curves bound basins in a plane alone; leave the manifolds or the effect out"
        )
    changed = [effect.name for effect in model.rig.effects if effect.does("stop") and isinstance(model.rig.law, AbstractInstantaneousLaw)]
    if changed:
        raise InputError(
            f"manifolds are asked for beside {', '.join(changed)}: expected a rigid stop of one restitution, by which curves are continued "
            "through it; leave the manifolds or the effect out"
        )


_NUDGE = 1e-3
"""Cells: half the distance of the points from which a derivative is taken."""
_ITERATIONS = 15
_LONGEST_STEP = 5.0
"""Cells that one step of Newton's method goes at most."""
_CLOSED = 1e-6
"""Cells by which a fixed point may miss its image."""
_SAME = 1e-2
"""Cells below which two fixed points are one."""
_FOLLOWED = 24
"""Cycles for which a motion from the boundary is watched: it passes a saddle before it leaves for an attractor."""
_PASSES = 3
"""Of its nearest passes, those that become candidates."""


class Saddle(NamedTuple):
    """A periodic orbit with one multiplier outside the unit circle and one inside."""

    orbits: list[Orbit]
    """The same motion from each of its section points on: q of them, each with its own monodromy matrix."""
    points: Curve
    """Its section points, in cells."""

    @property
    def cycles(self) -> int:
        """q."""
        return self.orbits[0].cycles

    @property
    def multipliers(self) -> tuple[float, float]:
        """That outside the unit circle, and that inside; of one sign, since energy is lost and the map keeps its orientation."""
        outside, inside = np.real(self.orbits[0].multipliers)
        return float(outside), float(inside)


def saddles(
    plane: StrobeMap, longest: int, shape: tuple[int, int], boundary: Curve, progress: Callable[[str], None] = lambda stage: None
) -> list[Saddle]:
    """Saddle orbits of up to so many cycles in and near a picture.

    Their section points lie no farther from the picture than its side, or where motions from the boundary of the basins pass.
    Candidates are the cells over which both components of P^q(x) - x change sign, and the places where motions from the boundary of
    the basins nearly repeat: on the boundary they tend to its saddles. Newton's method with differences of the map goes on from all of
    them side by side, and `find_orbit` confirms what it finds. A saddle that is near to no candidate is missed.

    Arguments:
        plane: the map P of one cycle.
        longest: largest q.
        shape: cells of the picture along u and u'; cell centres are at whole numbers.
        boundary: centres of cells at a boundary of the basins.
        progress: called with each stage.

    Returns:
        By q, those of one q by the size of their multiplier outside.
    """
    motions = _followed(plane, boundary, _FOLLOWED + longest)
    cells = np.stack(np.meshgrid(*(np.arange(float(side)) for side in shape)), axis=-1)
    reached, found = cells.reshape(-1, 2), list[Saddle]()
    side = np.array(shape, dtype=float)
    around = np.concatenate([np.stack([-side, 2.0 * side]), motions[np.isfinite(motions).all(axis=-1)]])
    room = around.min(axis=0), around.max(axis=0)
    for cycles in range(1, longest + 1):
        progress(f"looking for saddles of {cycles} cycles" if cycles > 1 else "looking for saddles of 1 cycle")
        reached = plane.image(reached)
        candidates = np.concatenate([_changing(cells, reached.reshape(cells.shape) - cells), _passes(motions, cycles)])
        power = StrobeMap(plane.rig, cycles, plane.origin, plane.cell)
        points = _fixed(power, candidates, room)
        points = points[_is_saddle(jacobian(power, points))]
        for point in points:
            known = np.concatenate([np.zeros((0, 2)), *(one.points for one in found)])
            if np.any(np.linalg.norm(known - point, axis=1) < _SAME):
                continue
            saddle = _confirmed(plane, point, cycles)
            found += [] if saddle is None else [saddle]
    return sorted(found, key=lambda one: (one.cycles, abs(one.multipliers[0])))


def jacobian(plane: AbstractPlaneMap, points: Curve) -> np.ndarray:
    """Derivative of the map at points, by central differences, `(points, 2, 2)`.

    Example:
        >>> import equinox as eqx
        >>> class Shear(AbstractPlaneMap):
        ...     def image(self, points):
        ...         return points @ np.array([[1.0, 0.0], [3.0, 2.0]])
        >>> jacobian(Shear(), np.zeros((1, 2))).round(6).tolist()
        [[[1.0, 3.0], [0.0, 2.0]]]
    """
    moved = points[:, None, None] + _NUDGE * np.eye(2)[:, None] * np.array([1.0, -1.0])[:, None]
    image = plane.image(moved.reshape(-1, 2)).reshape(moved.shape)
    return np.swapaxes(image[:, :, 0] - image[:, :, 1], 1, 2) / (2.0 * _NUDGE)


def _followed(plane: AbstractPlaneMap, points: Curve, cycles: int) -> np.ndarray:
    """Section points of motions, `(cycles + 1, motions, 2)`."""
    found = [points]
    for _ in range(cycles if len(points) else 0):
        found.append(plane.image(found[-1]))
    return np.stack(found)


def _passes(motions: np.ndarray, cycles: int) -> Curve:
    """Where each motion comes nearest to itself so many cycles later, before it is on its attractor."""
    if len(motions) <= cycles:
        return np.zeros((0, 2))
    apart = np.linalg.norm(motions[cycles:] - motions[:-cycles], axis=-1)
    before, after = apart[:-2], apart[2:]
    least = np.where((apart[1:-1] <= before) & (apart[1:-1] <= after), apart[1:-1], np.inf)
    order = np.argsort(least, axis=0)[:_PASSES]
    places = np.take_along_axis(motions[1 : len(least) + 1], order[..., None], axis=0)
    return places[np.isfinite(np.take_along_axis(least, order, axis=0))]


def _changing(cells: np.ndarray, moved: np.ndarray) -> Curve:
    """Centres between four cells over which both components of a displacement change sign."""
    corners = np.stack([moved[:-1, :-1], moved[:-1, 1:], moved[1:, :-1], moved[1:, 1:]])
    changes = np.all((corners.min(axis=0) <= 0) & (corners.max(axis=0) >= 0), axis=-1)
    return cells[:-1, :-1][changes] + 0.5


def _fixed(plane: AbstractPlaneMap, points: Curve, room: tuple[Place, Place]) -> Curve:
    """Fixed points that Newton's method reaches within a rectangle, each once."""
    points = _distinct(points, 1.0)
    for _ in range(_ITERATIONS):
        points = points[np.all((points >= room[0]) & (points <= room[1]), axis=1)]
        off = plane.image(points) - points
        matrix = jacobian(plane, points) - np.eye(2)
        known = np.isfinite(off).all(axis=1) & np.isfinite(matrix).all(axis=(1, 2))
        points, off, matrix = points[known], off[known], matrix[known]
        good = np.abs(np.linalg.det(matrix)) > np.finfo(float).eps
        points, off, matrix = points[good], off[good], matrix[good]
        step = -np.linalg.solve(matrix, off[..., None])[..., 0]
        size = np.linalg.norm(step, axis=1, keepdims=True)
        points = _distinct(points + step * np.minimum(1.0, _LONGEST_STEP / np.maximum(size, _LONGEST_STEP)), _SAME)
    points = plane.fold(points)
    return points[np.linalg.norm(plane.image(points) - points, axis=1) < _CLOSED]


def _distinct(points: Curve, spacing: float) -> Curve:
    """One of the points in each square of a grid."""
    return points[np.unique(np.round(points / spacing), axis=0, return_index=True)[1]]


def _is_saddle(matrices: np.ndarray) -> np.ndarray:
    """Whether one multiplier lies outside the unit circle and one inside."""
    size = np.sort(np.abs(np.linalg.eigvals(matrices)), axis=-1).reshape(-1, 2)
    return (size[:, 0] < 1.0) & (size[:, 1] > 1.0)


def _confirmed(plane: StrobeMap, point: Place, cycles: int) -> Saddle | None:
    """The orbit through a point, by shooting from each of its section points; None where it is no saddle of just so many cycles."""
    points = _followed(plane, point[None], cycles - 1)[:, 0]
    if any(np.linalg.norm(later - point) < _SAME for later in points[1:]):
        return None
    try:
        orbits = [find_orbit(plane.rig, state, cycles=cycles) for state in plane.states(points)]
    except NoConvergenceError:
        return None
    points = (np.array([orbit.state for orbit in orbits]) - plane.origin) / plane.cell
    real = all(not np.any(np.imag(orbit.multipliers)) for orbit in orbits)
    return Saddle(orbits, points) if real and all(_is_saddle(orbit.monodromy[None])[0] for orbit in orbits) else None
