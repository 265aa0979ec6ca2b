"""A branch of periodic orbits: the curve and its points, the special points at which something changes, and the table of all of it."""

import dataclasses
import enum
from collections.abc import Callable, Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from vibrojax.continuation.orbit import (
    Orbit,
    flip_test,
    fold_test,
    has_unit_pair,
    is_stable,
    map_with_jacobian,
    multipliers,
    solved,
    state_scale,
    torus_test,
)
from vibrojax.continuation.rig import ForcedRig, Passage, as_arrays
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate import Landing

Coordinates = Float[np.ndarray, " coordinates"]
_TOLERANCE = 1e-10
_ITERATIONS = 8
_WORSE = 2.0


@dataclasses.dataclass(frozen=True)
class Point:
    """One orbit of a branch, in the coordinates z = (state / scale, parameter / scale)."""

    z: Coordinates
    monodromy: Float[np.ndarray, "states states"]
    """In SI."""
    tangent: Coordinates
    """Of length one; the caller chooses its sense (`towards`)."""
    passage: Passage
    corrections: int
    """Newton steps that it took."""

    def towards(self, direction: Coordinates) -> "Point":
        """The same point, its tangent in the sense of a direction."""
        return self if self.tangent @ direction >= 0 else dataclasses.replace(self, tangent=-self.tangent)


@dataclasses.dataclass(frozen=True)
class Curve:
    """The curve P^p(x; parameter) = x of one family of orbits in scaled coordinates.

    Arguments:
        rig: the rig; all its numbers but one stay.
        name: of the parameter that varies along the curve.
        cycles: p.
        landing: the integrator.
        scale: of the states and of the parameter.
    """

    rig: ForcedRig
    name: str
    cycles: int
    landing: Landing
    scale: Coordinates

    def corrected(self, guess: Coordinates, normal: Coordinates) -> Point:
        """The point of the curve on the plane through a guess, by Newton's method on P^p(x) - x = 0 and normal . (z - guess) = 0.

        Raises:
            NoConvergenceError: the closing error does not reach its tolerance, or grows.
        """
        z, last = guess, np.inf
        for corrections in range(_ITERATIONS + 1):
            gap, jacobian, monodromy, passage = self._closing(z)
            error = float(np.max(np.abs(gap)))
            if error < _TOLERANCE and corrections > 0:
                return Point(z, monodromy, null_vector(jacobian), passage, corrections)
            if not error < _WORSE * last:
                break
            bordered = np.vstack([jacobian, normal])
            z = z - solved(bordered, np.append(gap, normal @ (z - guess)))
            last = error
        raise NoConvergenceError(f"no orbit on the plane through {self.name} = {guess[-1] * self.scale[-1]:g}: closing error {error:.1e}")

    def tangent_at(self, z: Coordinates) -> tuple[Coordinates, int]:
        """Unit vector along which the closing error does not change, at a point that need not be on the curve, and its impacts."""
        _, jacobian, _, passage = self._closing(z)
        return null_vector(jacobian), int(passage.touches)

    def start(self, orbit: Orbit) -> Point:
        """The point of a given orbit."""
        z = np.append(orbit.state, float(self.rig.value(self.name))) / self.scale
        return self.corrected(z, np.eye(len(z))[-1])

    def rig_at(self, point: Point) -> ForcedRig:
        """The rig with the parameter of a point."""
        return as_arrays(self.rig.replace(self.name, float(point.z[-1] * self.scale[-1])))

    def orbit(self, point: Point) -> Orbit:
        """The orbit of a point."""
        return Orbit(self.rig_at(point), self.cycles, point.z[:-1] * self.scale[:-1], point.monodromy, point.passage)

    def _closing(self, z: Coordinates):
        """Closing error and its Jacobian in scaled coordinates; monodromy matrix in SI; passage."""
        state = z[:-1] * self.scale[:-1]
        rig = as_arrays(self.rig.replace(self.name, float(z[-1] * self.scale[-1])))
        reached, full, passage = map_with_jacobian(self.landing, rig, self.name, self.cycles, state)
        jacobian = (full - np.eye(*full.shape)) * self.scale / self.scale[:-1, None]
        return (reached - state) / self.scale[:-1], jacobian, full[:, :-1], passage


def curve_through(orbit: Orbit, name: str, span: float, landing: Landing) -> Curve:
    """The curve through an orbit along one parameter; `span` is the range of the parameter that counts as one."""
    return Curve(as_arrays(orbit.rig), name, orbit.cycles, landing, np.append(sizes_of(orbit), span))


def sizes_of(orbit: Orbit) -> Coordinates:
    """Scales of the states along a branch: those of the rig, larger where the gap or the orbit is larger than A0."""
    sizes = state_scale(orbit.rig)
    sizes[:2] *= max(sizes[0], abs(float(orbit.rig.gap)), float(orbit.passage.highest), -float(orbit.passage.lowest)) / sizes[0]
    return sizes


def null_vector(jacobian: Float[np.ndarray, "states coordinates"]) -> Coordinates:
    """Unit vector that the Jacobian maps to nothing."""
    return np.linalg.svd(jacobian)[2][-1]


_FINEST = 1e-9
_SMALLER = 0.05
"""A test that vanishes falls to this part of its values at the ends of the step; one that jumps does not."""
_ON_CIRCLE = 1e-3


class Kind(enum.Enum):
    """What happens at a special point."""

    FOLD = "fold"
    """Two orbits, one of them unstable, meet and vanish: a multiplier passes +1 while the branch turns back. Sweeps jump here."""
    BRANCH_POINT = "branch point"
    """A multiplier passes +1 and the branch goes on: another branch crosses."""
    PERIOD_DOUBLING = "period doubling"
    """A multiplier passes -1: an orbit of twice the period is born."""
    TORUS = "Neimark-Sacker"
    """A complex pair leaves the unit circle: quasi-periodic motion is born."""
    GRAZING = "grazing"
    """An impact of speed zero: beyond, the orbit has one impact more or fewer, or does not exist."""
    GRAZING_FOLD = "grazing fold"
    """A grazing at which the branch turns back in a corner, without a multiplier passing +1 smoothly. Sweeps jump here."""


class SpecialPoint(eqx.Module):
    """Where on a branch something happens."""

    kind: Kind = eqx.field(static=True)
    parameter: float
    orbit: Orbit
    """The nearest one found."""
    bracket: float
    """Distance of the parameter between the nearest orbits found on either side."""


def special_points(curve: Curve, before: Point, after: Point) -> list[SpecialPoint]:
    """What happens between two neighbouring points of a branch as it is followed, each located by bisection along the chord.

    A sign change by a jump (as of multipliers at a grazing with a stiff stop) is not reported as a passage of a multiplier.
    """
    along = (after.z - before.z) / np.linalg.norm(after.z - before.z)
    turns = bool(before.tangent[-1] * after.tangent[-1] < 0)  # tangents at the ends point along the branch as it is followed
    tests: list[tuple[Kind, Callable[[Point], float]]] = [
        (Kind.FOLD, lambda point: float(point.tangent[-1] * np.sign(point.tangent @ along))),
        *([] if turns else [(Kind.BRANCH_POINT, lambda point: fold_test(point.monodromy))]),
        (Kind.PERIOD_DOUBLING, lambda point: flip_test(point.monodromy)),
        (Kind.TORUS, lambda point: torus_test(point.monodromy)),
    ]
    found = [_passage(curve, before, after, kind, test) for kind, test in tests]
    places = [place for place in found if place is not None]
    if int(before.passage.touches) != int(after.passage.touches):
        corner = turns and Kind.FOLD not in {place.kind for place in places}
        places.append(_grazing(curve, before, after, Kind.GRAZING_FOLD if corner else Kind.GRAZING))
    return sorted(places, key=lambda place: float(np.append(place.orbit.state, place.parameter) / curve.scale @ along))


def _passage(curve: Curve, before: Point, after: Point, kind: Kind, test: Callable[[Point], float]) -> SpecialPoint | None:
    """Where a smooth test vanishes between two points; None where it does not, or jumps."""
    ends = test(before), test(after)
    if ends[0] * ends[1] >= 0:
        return None
    low, high = _bisect(curve, before, after, lambda point: np.sign(test(point)) == np.sign(ends[0]), lambda: None)
    nearer = min(low, high, key=lambda point: abs(test(point)))
    jumps = abs(test(nearer)) > _SMALLER * min(abs(end) for end in ends)
    if jumps or (kind is Kind.TORUS and not has_unit_pair(multipliers(nearer.monodromy), _ON_CIRCLE)):
        return None
    return _place(curve, kind, nearer, low, high)


def _grazing(curve: Curve, before: Point, after: Point, kind: Kind) -> SpecialPoint:
    """Where the number of impacts changes between two points.

    With a rigid stop Newton's method fails just beyond the grazing, on the side with more impacts: there a failure counts as that side.
    """
    touches = int(before.passage.touches)
    fewer_first = touches < int(after.passage.touches)
    low, high = _bisect(curve, before, after, lambda point: int(point.passage.touches) == touches, lambda: not fewer_first)
    return _place(curve, kind, low if fewer_first else high, low, high)


def _bisect(
    curve: Curve, before: Point, after: Point, like_first: Callable[[Point], bool], on_failure: Callable[[], bool | None]
) -> tuple[Point, Point]:
    """The last points found on either side of a change, the stretch halved until it is as short as Newton's method can resolve.

    `on_failure` says whether a plane without an orbit lies on the side of the first point; None ends the search.
    """
    first, last = before, after
    low, high, length = 0.0, 1.0, float(np.linalg.norm(after.z - before.z))
    while (high - low) * length > _FINEST:
        middle = 0.5 * (low + high)
        try:
            point = curve.corrected(before.z + middle * (after.z - before.z), (after.z - before.z) / length)
            on_first_side = like_first(point)
            first, last = (point, last) if on_first_side else (first, point)
        except NoConvergenceError:
            on_first_side = on_failure()
            if on_first_side is None:
                break
        low, high = (middle, high) if on_first_side else (low, middle)
    return first, last


def _place(curve: Curve, kind: Kind, at: Point, low: Point, high: Point) -> SpecialPoint:
    """A special point at one of two neighbours."""
    width = float(abs(high.z[-1] - low.z[-1]) * curve.scale[-1])
    return SpecialPoint(kind, float(at.z[-1] * curve.scale[-1]), curve.orbit(at), width)


def comma_separated(columns: Mapping[str, np.ndarray]) -> str:
    """Columns of a table as comma-separated text with a header; numbers as exact as they are."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n"


class End(enum.Enum):
    """Why a branch was followed no further."""

    BOUND = "the parameter reached the end of its range"
    CLOSED = "the branch closed on itself"
    POINTS = "the most points allowed were computed"
    GRAZING = "the orbit grazes the stop, and no orbit of this kind lies beyond"
    BORN = "the period is half as long there: orbits of this branch are born by period doubling"
    LOST = "no further orbit was found at the shortest step"


class Branch(eqx.Module):
    """Periodic orbits of one family along one parameter, in the order in which they were met."""

    name: str = eqx.field(static=True)
    """Of the parameter."""
    label: str = eqx.field(static=True)
    """Symbol and unit of the parameter."""
    cycles: int = eqx.field(static=True)
    """Period in periods of the cart."""
    rigid: bool = eqx.field(static=True)
    """Whether the stop is rigid, so that there is no peak force."""
    parameter: Float[np.ndarray, " points"]
    states: Float[np.ndarray, "points states"]
    """(u, u', ...) at the section, m and m/s."""
    multipliers: Complex[np.ndarray, "points states"]
    touches: Int[np.ndarray, " points"]
    """Impacts in one period."""
    peak_force: Float[np.ndarray, " points"]
    """N; zero for a rigid stop."""
    impact_speed: Float[np.ndarray, " points"]
    """Of the fastest impact, m/s; zero without one."""
    highest: Float[np.ndarray, " points"]
    """Largest u, m."""
    special: tuple[SpecialPoint, ...]
    ends: tuple[End, End] = eqx.field(static=True)
    """Why the branch ends at its first and at its last point."""

    @property
    def stable(self) -> Bool[np.ndarray, " points"]:
        """Whether all multipliers lie inside the unit circle."""
        return is_stable(self.multipliers)

    def columns(self) -> dict[str, np.ndarray]:
        """The branch as columns of a plain table: one row a point."""
        states = {"u_m": self.states[:, 0], "v_m_per_s": self.states[:, 1]}
        own = {f"own_{index}": self.states[:, 2 + index] for index in range(self.states.shape[1] - 2)}
        roots = {}
        for index in range(self.multipliers.shape[1]):
            mu = self.multipliers[:, index]
            roots |= {f"mu{index + 1}_real": np.real(mu), f"mu{index + 1}_imag": np.imag(mu)}
        force = {} if self.rigid else {"peak_force_N": self.peak_force}
        return {
            self.name: self.parameter,
            **states,
            **own,
            "stable": self.stable.astype(int),
            "touches": self.touches,
            "impact_speed_m_per_s": self.impact_speed,
            **force,
            "highest_u_m": self.highest,
            **roots,
        }

    def csv(self) -> str:
        """`columns` as comma-separated text with a header; numbers as exact as they are."""
        return comma_separated(self.columns())

    def special_table(self) -> list[dict[str, str | int | float | bool]]:
        """One row a special point: kind, parameter, width of its bracket, largest multiplier, impacts a period."""
        return [
            {
                "kind": place.kind.value,
                self.name: place.parameter,
                "bracket": place.bracket,
                "mu1_real": float(place.orbit.multipliers[0].real),
                "mu1_imag": float(place.orbit.multipliers[0].imag),
                "mu2_real": float(place.orbit.multipliers[1].real),
                "mu2_imag": float(place.orbit.multipliers[1].imag),
                "touches": place.orbit.touches,
                "impact_speed_m_per_s": float(place.orbit.passage.fastest_touch),
                "peak_force_N": float(place.orbit.passage.peak_force),
            }
            for place in self.special
        ]
