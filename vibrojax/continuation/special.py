"""Points of a branch at which something changes: how they are noticed between two points, and located."""

import dataclasses
import enum
from collections.abc import Callable

import equinox as eqx
import numpy as np

from vibrojax.continuation.arclength import Coordinates, Curve, Point
from vibrojax.continuation.multipliers import flip_test, fold_test, has_unit_pair, multipliers, torus_test
from vibrojax.continuation.orbit import Orbit
from vibrojax.errors import NoConvergenceError

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


@dataclasses.dataclass(frozen=True)
class _Watch:
    """A smooth function of a point whose change of sign announces something."""

    test: Callable[[Point], float]
    kind: Callable[[Point], Kind | None]


def special_points(curve: Curve, before: Point, after: Point) -> list[SpecialPoint]:
    """What happens between two neighbouring points of a branch as it is followed, each located by bisection along the chord.

    A sign change by a jump (as of multipliers at a grazing with a stiff stop) is not reported as a passage of a multiplier.
    """
    along = (after.z - before.z) / np.linalg.norm(after.z - before.z)
    found = [_passage(curve, before, after, watch) for watch in _watches(before, after, along)]
    places = [place for place in found if place is not None]
    if int(before.passage.touches) != int(after.passage.touches):
        corner = _turns(before, after) and Kind.FOLD not in {place.kind for place in places}
        places.append(_grazing(curve, before, after, Kind.GRAZING_FOLD if corner else Kind.GRAZING))
    return sorted(places, key=lambda place: float(np.append(place.orbit.state, place.parameter) / curve.scale @ along))


def _watches(before: Point, after: Point, along: Coordinates) -> list[_Watch]:
    """Tests for this stretch."""
    turns = _turns(before, after)
    return [
        _Watch(lambda point: _slope(point, along), lambda _: Kind.FOLD),
        _Watch(lambda point: fold_test(point.monodromy), lambda _: None if turns else Kind.BRANCH_POINT),
        _Watch(lambda point: flip_test(point.monodromy), lambda _: Kind.PERIOD_DOUBLING),
        _Watch(lambda point: torus_test(point.monodromy), _torus),
    ]


def _turns(before: Point, after: Point) -> bool:
    """Whether the parameter goes the other way after the step: tangents at its ends point along the branch as it is followed."""
    return bool(before.tangent[-1] * after.tangent[-1] < 0)


def _slope(point: Point, along: Coordinates) -> float:
    """How fast the parameter changes along the branch, in the sense of `along`."""
    return float(point.tangent[-1] * np.sign(point.tangent @ along))


def _torus(point: Point) -> Kind | None:
    return Kind.TORUS if has_unit_pair(multipliers(point.monodromy), _ON_CIRCLE) else None


def _passage(curve: Curve, before: Point, after: Point, watch: _Watch) -> SpecialPoint | None:
    """Where a test vanishes between two points; None where it does not, or jumps."""
    ends = watch.test(before), watch.test(after)
    if ends[0] * ends[1] >= 0:
        return None
    low, high = _bisect(curve, before, after, lambda point: np.sign(watch.test(point)) == np.sign(ends[0]), lambda: None)
    nearer = min(low, high, key=lambda point: abs(watch.test(point)))
    kind = watch.kind(nearer) if abs(watch.test(nearer)) <= _SMALLER * min(abs(end) for end in ends) else None
    return None if kind is None else _place(curve, kind, nearer, low, high)


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
