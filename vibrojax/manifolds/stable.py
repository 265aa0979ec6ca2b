"""The stable manifold of a saddle, grown by the search-circle algorithm, which needs no inverse of the map."""

import dataclasses
from typing import NamedTuple

import numpy as np

from vibrojax.manifolds.base import AbstractPlaneMap, Curve, Place
from vibrojax.manifolds.traced import Traced

_RADII = (1.0, 0.5, 0.25, 0.125)
"""Of the circles searched at once, over the step."""
_ANGLES = 16
_SPREAD = 0.5
"""Half the arc that is searched, rad: beyond the largest angle that is accepted."""
_TRIES = 20_000
"""Points that are looked for on one branch, at most."""
_FINE = 0.1
"""Cells between neighbouring images on an arc, below which the crossing lies on a straight piece between them."""
_REFINEMENTS = 4
_GROWS = 4.0
"""The longest step that is tried next, over one that turned little."""
_BACK = 0.25
"""Of a step from whose end the curve does not go on: the step that is taken in its place."""
_NOISE = 1e-2
"""Error of a length along the curve, over the shortest step: at a corner a crossing no farther on is the way back."""
_DETOUR = 1.25
"""Length of the curve between two images over their distance: more, and the image has skipped a bend."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Steps:
    """Spacing of a curve's points, in cells.

    A step is halved where the curve turns by more than `largest_angle`, or by more than `bend` cells aside, and doubled where it turns by
    less than `smallest_angle`: the rules and the angles are those of Krauskopf and Osinga 1998.

    Attributes:
        first: distance of the first point from the saddle, along the eigenvector.
        largest: longest step.
        smallest: at this step the curve may turn by any angle, as it does where the map has a corner: at a grazing.
        largest_angle: rad.
        smallest_angle: rad.
        bend: step times angle.
    """

    first: float = 0.05
    largest: float = 4.0
    smallest: float = 1e-3
    largest_angle: float = 0.3
    smallest_angle: float = 0.2
    bend: float = 0.1


class _Found(NamedTuple):
    """A point of the curve."""

    point: Place
    heading: float
    """Of the piece that ends here, rad."""
    step: float
    """Its length."""
    length: float
    """Along the curve, where the image of the point lies on it."""


def stable_branch(
    plane: AbstractPlaneMap, saddle: Place, direction: Place, *, low: Place, high: Place, longest: float, steps: Steps | None = None
) -> tuple[Curve, bool]:
    """One branch of the stable manifold: points that the map takes to others nearer to the saddle along the same curve.

    The next point lies on a circle around the last one, where the image of the circle crosses the curve found so far.

    Arguments:
        plane: the map, with the saddle as fixed point and a positive multiplier along `direction`.
        saddle: in cells.
        direction: unit vector along which the map contracts.
        low: lower left corner of the region where the curve is sought, cells.
        high: upper right corner.
        longest: length at which it ends, cells.
        steps: spacing.

    Returns:
        The curve from the saddle on, with a row of NaN where it passes a rigid stop, and whether it ended before the region and `longest`,
        for want of a next point.

    Source: J. P. England, B. Krauskopf, H. M. Osinga, Computing one-dimensional stable manifolds and stable sets of planar maps without
    the inverse, SIAM Journal on Applied Dynamical Systems 3 (2004) 161-190; several circles at once, ours.
    """
    steps = Steps() if steps is None else steps
    curve = Traced(plane, saddle - steps.first * direction, saddle)
    curve.add(saddle + steps.first * direction)
    image = plane.image(np.array([curve.points[-1]]))[0]
    trail = [_Found(curve.points[-1], float(np.arctan2(direction[1], direction[0])), steps.first, float((image - saddle) @ direction))]
    step = steps.first
    for _ in range(_TRIES):
        if curve.lengths[-1] >= longest:
            return curve.path(), False
        found = _next(plane, curve, trail[-1], step, steps)
        if found is None and trail[-1].step > steps.smallest and len(trail) > 1:
            curve.remove()
            step = max(_BACK * trail.pop().step, steps.smallest)
            continue
        found = found or _corner(plane, curve, trail[-1], steps)
        if found is None:
            return curve.path(), True
        curve.add(found.point)
        here = plane.fold(found.point[None])[0]
        if np.any(here < low) or np.any(here > high):
            return curve.path(), False
        grows = abs(_turn(trail[-1], found)) < steps.smallest_angle
        step = float(np.clip(_GROWS * found.step if grows else found.step, steps.smallest, steps.largest))
        trail.append(found)
    return curve.path(), True


def _next(plane: AbstractPlaneMap, curve: Traced, last: _Found, step: float, steps: Steps) -> _Found | None:
    """The next point at the longest step that turns little enough; None where there is none down to the shortest."""
    while step >= steps.smallest:
        radii = np.unique(np.clip(step * np.array(_RADII), steps.smallest, steps.largest))[::-1]
        angles = np.broadcast_to(np.linspace(-_SPREAD, _SPREAD, _ANGLES), (len(radii), _ANGLES))
        arcs = _images(plane, last, radii, angles)
        coarse = [_nearest(curve, arc, last.length - _NOISE * steps.smallest, last.length) for arc in arcs]
        for radius, arc, here, inner in zip(radii, arcs, coarse, [*coarse[1:], None], strict=True):
            on_the_way = inner is not None or radius <= steps.smallest
            found = _refined(plane, curve, last, float(radius), angles[0], arc, here[0], steps) if here and on_the_way else None
            turn = 0.0 if found is None else abs(_turn(last, found))
            if found and turn <= steps.largest_angle and turn * radius <= steps.bend and _follows(curve, last, found, steps):
                return found
        step *= _RADII[-1]
    return None


def _corner(plane: AbstractPlaneMap, curve: Traced, last: _Found, steps: Steps) -> _Found | None:
    """The next point whatever the curve turns by, on the smallest circle where the image goes on.

    Behind a grazing of a rigid stop the image goes on with the square of the distance alone.
    """
    angles, radius = np.linspace(-np.pi, np.pi, _ANGLES * len(_RADII)), steps.smallest
    while radius <= steps.largest:
        arc = _images(plane, last, np.array([radius]), angles[None])[0]
        _, positions, _ = curve.crossings(arc[None], last.length - radius)
        each = [_refined(plane, curve, last, radius, angles, arc, float(position), steps) for position in positions]
        ahead = [found for found in each if found and found.length > last.length + _NOISE * steps.smallest]
        on = [found for found in ahead if _follows(curve, last, found, steps)]
        if on:
            return min(on, key=lambda found: found.length)
        radius *= _GROWS
    return None


def _turn(last: _Found, found: _Found) -> float:
    """By how much the curve turns at the last point, rad."""
    return float(np.mod(found.heading - last.heading + np.pi, 2.0 * np.pi) - np.pi)


def _follows(curve: Traced, last: _Found, found: _Found, steps: Steps) -> bool:
    """Whether the curve between the last image and this one is nearly straight, so that none of its bends was skipped."""
    apart = float(np.linalg.norm(curve.place(found.length) - curve.place(last.length)))
    return found.length - last.length <= _DETOUR * apart + 4.0 * steps.smallest


def _nearest(curve: Traced, arc: np.ndarray, least: float, at: float) -> tuple[float, float] | None:
    """Position on an arc and length along the curve of the crossing that is next to a length."""
    _, positions, lengths = curve.crossings(arc[None], least)
    if not lengths.size:
        return None
    nearest = int(np.argmin(np.abs(lengths - at)))
    return float(positions[nearest]), float(lengths[nearest])


def _refined(
    plane: AbstractPlaneMap, curve: Traced, last: _Found, radius: float, angles: np.ndarray, arc: np.ndarray, position: float, steps: Steps
) -> _Found | None:
    """The crossing on one circle, its angle refined until neighbouring images are near; None where it does not stay."""
    length = last.length
    for _ in range(_REFINEMENTS):
        number = min(int(position), len(angles) - 2)
        angles = np.linspace(angles[number], angles[number + 1], _ANGLES * len(_RADII))
        arc = _images(plane, last, np.array([radius]), angles[None])[0]
        here = _nearest(curve, arc, last.length - _NOISE * steps.smallest, last.length)
        if here is None:
            return None
        position, length = here
        number = min(int(position), len(angles) - 2)
        if np.linalg.norm(arc[number + 1] - arc[number]) < _FINE:
            break
    heading = last.heading + float(np.interp(position, np.arange(len(angles)), angles))
    return _Found(last.point + radius * np.array([np.cos(heading), np.sin(heading)]), heading, radius, length)


def _images(plane: AbstractPlaneMap, last: _Found, radii: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Images of points on circles around the last point, by the angle from its heading, `(circles, angles, 2)`."""
    turned = last.heading + angles
    points = last.point + radii[:, None, None] * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    return plane.image(points.reshape(-1, 2)).reshape(points.shape)
