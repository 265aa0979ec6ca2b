"""Follow a branch of periodic orbits through folds and corners, stable or not, and start branches of twice the period."""

import dataclasses
import functools
from collections.abc import Callable

import numpy as np

from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.branch import Branch, Coordinates, Curve, End, Kind, Point, SpecialPoint, curve_through, special_points
from vibrojax.continuation.orbit import Orbit, landing_of, map_with_jacobian, multipliers
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import Landing

_BEYOND_CORNER = 10.0 ** np.arange(-7.0, -1.5, 0.5)
"""Distances beyond a grazing, in scaled coordinates, at which the slope of the other piece is taken in turn."""
_NEAR_CORNER = 20.0


def around_corner(curve: Curve, last: Point) -> Point | None:
    """The first point of the other piece of a branch that breaks off at a grazing; None where there is none.

    With a rigid stop, or a force that jumps or bends at the touch, the map has another slope on either side of a grazing, and the two
    pieces of a branch may both lie on the same side of it in the parameter: steps along the tangent then find nothing. Here the slope is
    taken a little beyond the grazing, where the motion has one impact more or fewer, and the piece that belongs to it is looked for from
    there, in both senses.

    Source: ours; that the two pieces meet in a corner is the border collision of H. E. Nusse, E. Ott, J. A. Yorke, Border-collision
    bifurcations: an explanation for observed bifurcation phenomena, Phys. Rev. E 49 (1994) 1073-1076.
    """
    touches = int(last.passage.touches)
    for reach in _BEYOND_CORNER:
        try:
            tangent, beyond = curve.tangent_at(last.z + reach * last.tangent)
        except NoConvergenceError:
            continue
        if beyond == touches:
            continue
        for sense in (1.0, -1.0):
            try:
                new = curve.corrected(last.z + sense * reach * tangent, tangent)
            except NoConvergenceError:
                continue
            offset = new.z - last.z
            if abs(int(new.passage.touches) - touches) == 1 and 0.0 < np.linalg.norm(offset) < _NEAR_CORNER * reach:
                return new.towards(offset)
    return None


_QUICK, _SLOW = 3, 6
_LONGER, _SHORTER = 1.5, 0.5
_STRAIGHT = 0.97
"""Least cosine between neighbouring tangents."""
_CORNER = 1e-4
"""A step this short may turn by any angle where the number of impacts changes: with a law of n <= 1 the branch has a corner there."""
_FIRST, _AFTER_CORNER, _SHORTEST = 5e-3, 5e-5, 1e-8
"""First step of all and after a corner, and the step below which the branch is given up, with the range of the parameter as one."""
_RETURNED = 8
_GRAZES_SPEED, _GRAZES_DISTANCE = 0.03, 1e-3
"""Slowest touch over the cart's speed, and clearance over its amplitude, below which a branch that breaks off does so at a grazing."""
_SINGULAR = 1e-3
"""Slowest touch over the cart's speed at which a branch with a rigid stop is at its end: the slope of the map grows like 1 / speed."""


@dataclasses.dataclass(frozen=True)
class _Arm:
    """The part of a branch on one side of its start."""

    points: list[Point]
    special: list[SpecialPoint]
    end: End


def follow(
    orbit: Orbit,
    name: str,
    bounds: tuple[float, float],
    *,
    born_at: SpecialPoint | None = None,
    landing: Landing | None = None,
    longest_step: float = 5e-2,
    most_points: int = 2000,
) -> Branch:
    """Follow the branch of an orbit both ways along one parameter, by pseudo-arclength continuation.

    Each step goes along the tangent of the curve P^p(x; parameter) = x and is corrected at right angles to the chord, so that folds are no
    obstacle. Folds, period doublings, branch points, Neimark-Sacker points and grazings are located by bisection.

    Arguments:
        orbit: where to start.
        name: of the parameter: "frequency" (Hz), "gap" (m), "amplitude" (m), "m" or a parameter of the model.
        bounds: lowest and highest value, SI; the orbit's own lies between.
        born_at: the period doubling from which the orbit comes (`doubled`): the branch is followed away from it alone, since beyond it the
            same orbits come again, one period of the old ones later, and it ends where its orbits have half their period again.
        landing: the integrator.
        longest_step: with the range of the parameter as one.
        most_points: in each direction.

    Raises:
        InputError: unknown parameter, or bounds that do not hold the start.
        NoConvergenceError: the start itself is not on a curve.

    Source: H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in P. Rabinowitz (ed.), Applications of
    Bifurcation Theory, Academic Press (1977) 359-384; step control ours.
    """
    low, high = (float(bound) for bound in bounds)
    value = float(orbit.rig.value(name))
    if not low < high or not low <= value <= high:
        raise InputError(f"{name} runs from {low:g} to {high:g}, the orbit is at {value:g}: expected a range that holds it; give another")
    curve = curve_through(orbit, name, high - low, landing_of(orbit.rig) if landing is None else landing)
    start = curve.start(orbit)
    limits = (low / curve.scale[-1], high / curve.scale[-1])
    arm = functools.partial(_arm, curve, start, limits=limits, longest_step=longest_step, most_points=most_points)
    up = start.towards(np.eye(len(start.z))[-1]).tangent
    if born_at is not None:
        away = start.z - np.append(born_at.orbit.state, born_at.parameter) / curve.scale
        least = 0.5 * _halves_apart(curve, start)
        forward = arm(start.towards(away).tangent, merges=lambda point: _halves_apart(curve, point) < least)
        backward = _Arm([start], [], End.BORN)
    else:
        forward = arm(up)
        backward = _Arm([start], [], End.CLOSED) if forward.end is End.CLOSED else arm(-up)
    points = [*reversed(backward.points[1:]), *forward.points]
    special = (*reversed(backward.special), *forward.special)
    return _branch(curve, points, special, (backward.end, forward.end))


def _halves_apart(curve: Curve, point: Point) -> float:
    """Distance, in scaled coordinates, of the states at the beginning and half-way through the period; 0 where the period is only half."""
    state = point.z[:-1] * curve.scale[:-1]
    halfway, _, _ = map_with_jacobian(curve.landing, curve.rig_at(point), curve.name, curve.cycles // 2, state)
    return float(np.linalg.norm((halfway - state) / curve.scale[:-1]))


def _arm(
    curve: Curve,
    start: Point,
    direction: Coordinates,
    *,
    limits: tuple[float, float],
    longest_step: float,
    most_points: int,
    merges: Callable[[Point], bool] = lambda point: False,
) -> _Arm:
    """Points from the start in one sense, until the orbits are no longer of this family."""
    arm, h = _Arm([dataclasses.replace(start, tangent=direction)], [], End.POINTS), _FIRST
    if not limits[0] <= start.z[-1] + 1e-12 * direction[-1] <= limits[1]:
        return dataclasses.replace(arm, end=End.BOUND)
    while len(arm.points) < most_points:
        last = arm.points[-1]
        singular = _slowest(curve, last) < _SINGULAR and isinstance(curve.rig.model.law, AbstractInstantaneousLaw)
        comes = len(arm.points) > 1 and int(last.passage.touches) == int(arm.points[-2].passage.touches)  # to a grazing: it leaves none
        new = None if singular and comes else _step(curve, last, h)
        if new is None:
            h *= _SHORTER
            if h >= _SHORTEST and not singular:
                continue
            new, h = around_corner(curve, last), _AFTER_CORNER
        if new is None:
            return dataclasses.replace(arm, end=_breaks_off(curve, last, arm))
        if merges(new):
            return dataclasses.replace(arm, end=End.BORN)
        outside = not limits[0] <= new.z[-1] <= limits[1]
        if outside:
            new = _at_bound(curve, last, new, limits)
            if new is None:
                return dataclasses.replace(arm, end=End.LOST)
        arm.special.extend(special_points(curve, last, new))
        arm.points.append(new)
        first = arm.points[0]
        near = len(arm.points) > _RETURNED and float(np.linalg.norm(new.z - first.z)) < h
        back = near and float(new.tangent @ first.tangent) > _STRAIGHT
        if outside or back:
            return dataclasses.replace(arm, end=End.BOUND if outside else End.CLOSED)
        h = min(h * (_LONGER if new.corrections <= _QUICK else _SHORTER if new.corrections >= _SLOW else 1.0), longest_step)
    return arm


def _step(curve: Curve, last: Point, h: float) -> Point | None:
    """The point a step further along the tangent; None where there is none near, or the branch bends too much in between."""
    try:
        new = curve.corrected(last.z + h * last.tangent, last.tangent)
    except NoConvergenceError:
        return None
    along = (new.z - last.z) / np.linalg.norm(new.z - last.z)
    new = new.towards(along)
    corner = h < _CORNER and int(new.passage.touches) != int(last.passage.touches)
    return new if corner or min(new.tangent @ along, last.tangent @ along) >= _STRAIGHT else None


def _at_bound(curve: Curve, last: Point, new: Point, limits: tuple[float, float]) -> Point | None:
    """The point at the end of the range between two points."""
    part = (np.clip(new.z[-1], *limits) - last.z[-1]) / (new.z[-1] - last.z[-1])
    try:
        return curve.corrected(last.z + part * (new.z - last.z), np.eye(len(last.z))[-1]).towards(last.tangent)
    except NoConvergenceError:
        return None


def _breaks_off(curve: Curve, last: Point, arm: _Arm) -> End:
    """Why there is no next point; a grazing becomes a special point."""
    orbit = curve.orbit(last)
    near = float(last.passage.closest) > -_GRAZES_DISTANCE * float(orbit.rig.base_amplitude)
    if _slowest(curve, last) >= _GRAZES_SPEED and not near:
        return End.LOST
    arm.special.append(_beyond(curve, arm.points[-2:], touching=_slowest(curve, last) < _GRAZES_SPEED))
    return End.GRAZING


def _beyond(curve: Curve, points: list[Point], *, touching: bool) -> SpecialPoint:
    """The grazing just beyond the last point: impact speed, or clearance, drawn on to zero as a straight line over the parameter."""
    left = [float(point.passage.slowest_touch if touching else -point.passage.closest) for point in points]
    values = [float(point.z[-1] * curve.scale[-1]) for point in points]
    shrinks = len(points) > 1 and np.isfinite(left[0]) and left[0] > left[1]
    extra = (values[1] - values[0]) * left[1] / (left[0] - left[1]) if shrinks else 0.0
    return SpecialPoint(Kind.GRAZING, values[-1] + extra, curve.orbit(points[-1]), abs(extra))


def _slowest(curve: Curve, point: Point) -> float:
    """Speed of the slowest touch over the greatest speed of the cart."""
    rig = curve.rig_at(point)
    return float(point.passage.slowest_touch) / (2.0 * np.pi * float(rig.frequency_hz) * float(rig.base_amplitude))


def _branch(curve: Curve, points: list[Point], special: tuple[SpecialPoint, ...], ends: tuple[End, End]) -> Branch:
    """Arrays out of points."""
    z = np.stack([point.z for point in points]) * curve.scale
    met = [point.passage for point in points]
    return Branch(
        name=curve.name,
        label=curve.rig.label(curve.name),
        cycles=curve.cycles,
        rigid=isinstance(curve.rig.model.law, AbstractInstantaneousLaw),
        parameter=z[:, -1],
        states=z[:, :-1],
        multipliers=np.stack([multipliers(point.monodromy) for point in points]),
        touches=np.array([int(passage.touches) for passage in met]),
        peak_force=np.array([float(passage.peak_force) for passage in met]),
        impact_speed=np.array([float(passage.fastest_touch) for passage in met]),
        highest=np.array([float(passage.highest) for passage in met]),
        special=special,
        ends=ends,
    )


_REACHES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
"""Displacements of the new orbit along the eigenvector, in scaled coordinates, that are tried in turn."""
_OTHER = 0.1
"""Least distance of the two passages of an orbit of twice the period, over that displacement."""


def doubled(place: SpecialPoint, name: str, span: float, *, landing: Landing | None = None) -> Orbit:
    """An orbit of twice the period near a period doubling.

    It is sought at a fixed displacement along the eigenvector of the multiplier -1; the parameter adapts itself, so that it does not matter
    on which side of the point the new orbits lie.

    Arguments:
        place: a period doubling.
        name: of the parameter along which it was found.
        span: range of the parameter that counts as one.
        landing: the integrator.

    Raises:
        InputError: the special point is none of period doubling.
        NoConvergenceError: no such orbit is found.

    Source: W. J. F. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM (2000), ch. 8 (branching at a flip).
    """
    if place.kind is not Kind.PERIOD_DOUBLING:
        raise InputError(f"no orbit of twice the period is born at a {place.kind.value}: expected a period doubling; take one")
    orbit = place.orbit
    landing = landing_of(orbit.rig) if landing is None else landing
    single = curve_through(orbit, name, span, landing)
    double = Curve(single.rig, name, 2 * orbit.cycles, landing, single.scale)
    values, vectors = np.linalg.eig(orbit.monodromy)
    vector = np.real(vectors[:, np.argmin(np.abs(values + 1.0))]) / single.scale[:-1]
    normal = np.append(vector / np.linalg.norm(vector), 0.0)
    z = np.append(orbit.state, place.parameter) / single.scale
    for reach in _REACHES:
        try:
            found = double.corrected(z + reach * normal, normal)
            apart = _halves_apart(double, found)
        except NoConvergenceError:
            continue
        if apart > _OTHER * reach:
            return double.orbit(found)
    raise NoConvergenceError(f"no orbit of {2 * orbit.cycles} cycles found near the period doubling at {name} = {place.parameter:g}")
