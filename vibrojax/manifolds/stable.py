"""The stable manifold of a saddle, grown by the search-circle algorithm, which needs no inverse of the map."""

import dataclasses
from typing import NamedTuple

import numpy as np

from vibrojax.manifolds.base import AbstractPlaneMap, Place, Plane
from vibrojax.manifolds.traced import Traced

_RADII = (2.0, 1.0, 0.5, 0.25)
"""Of the circles searched at once, over the step."""
_ANGLES = 16
_SPREAD = 0.5
"""Half the arc that is searched, rad: beyond the largest angle that is accepted."""
_WIDE = 2.8
"""Half the arc at the shortest step, rad: any turn but straight back."""
_FINE = 0.1
"""Cells between neighbouring images on an arc, below which the crossing lies on a straight piece between them."""
_REFINEMENTS = 4
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
    largest: float = 0.5
    smallest: float = 1e-3
    largest_angle: float = 0.3
    smallest_angle: float = 0.2
    bend: float = 0.1


class _Found(NamedTuple):
    """The next point of the curve."""

    point: Place
    angle: float
    """By which the curve turns, rad."""
    step: float
    length: float
    """Along the curve, where the image of the point lies on it."""


def stable_branch(
    plane: AbstractPlaneMap, saddle: Place, direction: Place, *, low: Place, high: Place, longest: float, steps: Steps | None = None
) -> tuple[Plane, bool]:
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
    at, step, heading = float((image - saddle) @ direction), steps.first, float(np.arctan2(direction[1], direction[0]))
    while curve.lengths[-1] < longest:
        found = _next(plane, curve, heading, at, step, steps)
        if found is None:
            return curve.path(), True
        curve.add(found.point)
        here = plane.fold(found.point[None])[0]
        if np.any(here < low) or np.any(here > high):
            break
        heading, at = heading + found.angle, found.length
        grows = abs(found.angle) < steps.smallest_angle
        step = float(np.clip(2.0 * found.step if grows else found.step, steps.smallest, steps.largest))
    return curve.path(), False


def _next(plane: AbstractPlaneMap, curve: Traced, heading: float, at: float, step: float, steps: Steps) -> _Found | None:
    """The next point at the longest step that turns little enough; at the shortest, whatever it turns by."""
    angles = np.linspace(-_SPREAD, _SPREAD, _ANGLES)
    while step >= steps.smallest:
        radii = np.unique(np.clip(step * np.array(_RADII), steps.smallest, steps.largest))[::-1]
        for found in _searched(plane, curve, heading, at, radii, angles, steps):
            sharp = abs(found.angle) > steps.largest_angle or abs(found.angle) * found.step > steps.bend
            if not sharp and _follows(curve, at, found, steps):
                return found
        step *= _RADII[-1] / 2.0
    radii, angles = np.array([steps.smallest]), np.linspace(-_WIDE, _WIDE, _ANGLES * len(_RADII))
    turned = [found for found in _searched(plane, curve, heading, at, radii, angles, steps) if _follows(curve, at, found, steps)]
    return min(turned, key=lambda found: abs(found.angle), default=None)


def _follows(curve: Traced, at: float, found: _Found, steps: Steps) -> bool:
    """Whether the curve between the last image and this one is nearly straight, so that none of its bends was skipped."""
    apart = float(np.linalg.norm(curve.place(found.length) - curve.place(at)))
    return found.length - at <= _DETOUR * apart + 4.0 * steps.smallest


def _searched(plane, curve: Traced, heading: float, at: float, radii: np.ndarray, angles: np.ndarray, steps: Steps) -> list[_Found]:
    """On each circle the crossing that is next along the curve, the largest circle first."""
    arcs = _images(plane, curve.points[-1], heading, radii, np.broadcast_to(angles, (len(radii), len(angles))))
    chain, position, length = curve.crossings(arcs, at - steps.smallest)
    result = []
    for number, radius in enumerate(radii):
        mine = np.flatnonzero(chain == number)
        if mine.size:
            nearest = mine[np.argmin(np.abs(length[mine] - at))]
            found = _refined(plane, curve, heading, at, float(radius), angles, arcs[number], float(position[nearest]), steps)
            result += [found] if found is not None else []
            if found is not None and abs(found.angle) <= steps.largest_angle and _follows(curve, at, found, steps):
                break
    return result


def _refined(plane, curve: Traced, heading: float, at: float, radius: float, angles, arc, position: float, steps: Steps) -> _Found | None:
    """The crossing on one circle, its angle refined until neighbouring images are near; None where it does not stay."""
    length = at
    for _ in range(_REFINEMENTS):
        number = min(int(position), len(angles) - 2)
        angles = np.linspace(angles[number], angles[number + 1], _ANGLES * len(_RADII))
        arc = _images(plane, curve.points[-1], heading, np.array([radius]), angles[None])[0]
        _, positions, lengths = curve.crossings(arc[None], at - steps.smallest)
        if not lengths.size:
            return None
        nearest = int(np.argmin(np.abs(lengths - at)))
        position, length = float(positions[nearest]), float(lengths[nearest])
        number = min(int(position), len(angles) - 2)
        if np.linalg.norm(arc[number + 1] - arc[number]) < _FINE:
            break
    angle = float(np.interp(position, np.arange(len(angles)), angles))
    point = curve.points[-1] + radius * np.array([np.cos(heading + angle), np.sin(heading + angle)])
    return _Found(point, angle, radius, length)


def _images(plane: AbstractPlaneMap, centre: Place, heading: float, radii: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Images of points on circles, `(circles, angles, 2)`."""
    turned = heading + angles
    points = centre + radii[:, None, None] * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    return plane.image(points.reshape(-1, 2)).reshape(points.shape)
