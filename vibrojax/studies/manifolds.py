"""Stable and unstable manifolds of a saddle of a map of the plane: the curves that bound basins of attraction and lead to attractors.

The stable one is grown by the search-circle algorithm, which needs no inverse of the map, the unstable one by mapping a piece of it on and
on.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from vibrojax.studies.saddles import AbstractPlaneMap, Curve, Place

_AHEAD = 400
"""Pieces of the curve that are searched for a crossing."""
_ROUNDING = 1e-9
"""By which a crossing may lie beyond the ends of a piece, over its length."""


class Traced:
    """Points of a curve with its length up to each; in the plane of the map it is a chain of straight pieces, broken at the edge.

    Arguments:
        plane: the map.
        tail: where the chain begins, behind the first point of the curve.
        start: first point of the curve; lengths are counted from it.
    """

    def __init__(self, plane: AbstractPlaneMap, tail: Place, start: Place):
        self.plane = plane
        self.points, self.lengths = [start], [0.0]
        self.breaks: list[int] = []
        """Numbers of the points behind which the curve passes the edge."""
        self._count = 0
        self._pieces = np.zeros((64, 6))
        self._piece(tail, start, -float(np.linalg.norm(start - tail)), 0.0)

    def add(self, point: Place) -> None:
        """Go on to a point."""
        last, begin = self.points[-1], self.lengths[-1]
        end = begin + float(np.linalg.norm(point - last))
        edge = self.plane.edge
        if (last[0] > edge) != (point[0] > edge):
            part = (edge - last[0]) / (point[0] - last[0])
            middle, length = last + part * (point - last), begin + part * (end - begin)
            inside = np.array([edge, middle[1]])
            beyond = np.array([np.nextafter(edge, np.inf), middle[1]])
            first, second = (beyond, inside) if last[0] > edge else (inside, beyond)
            self._piece(last, first, begin, length)
            self._piece(second, point, length, end)
            self.breaks.append(len(self.points) - 1)
        else:
            self._piece(last, point, begin, end)
        self.points.append(point)
        self.lengths.append(end)

    def remove(self) -> None:
        """Go back by one point."""
        self.points.pop()
        self.lengths.pop()
        passed = bool(self.breaks) and self.breaks[-1] == len(self.points) - 1
        if passed:
            self.breaks.pop()
        self._count -= 2 if passed else 1

    def path(self) -> Curve:
        """The points in the plane of the map, with a row of NaN at each passage of the edge."""
        folded = self.plane.fold(np.array(self.points))
        return np.insert(folded, [number + 1 for number in self.breaks], np.nan, axis=0)

    def place(self, length: float) -> Place:
        """The point of the chain at a length."""
        pieces = self._pieces[: self._count]
        number = min(int(np.searchsorted(pieces[:, 5], length)), self._count - 1)
        a, b, (begin, end) = pieces[number, :2], pieces[number, 2:4], pieces[number, 4:]
        return a + (b - a) * (length - begin) / (end - begin)

    def crossings(
        self, arcs: Float[np.ndarray, "arcs points 2"], least: float
    ) -> tuple[Int[np.ndarray, " found"], Float[np.ndarray, " found"], Float[np.ndarray, " found"]]:
        """Where chains of points cross the curve.

        Arguments:
            arcs: the chains, in the plane of the map; NaN where there is no point.
            least: length along the curve before which crossings do not count.

        Returns:
            Number of the chain, position on it (3.25: a quarter of the way from point 3 to point 4), and length along the curve.
        """
        first = int(np.searchsorted(self._pieces[: self._count, 5], least))
        pieces = self._pieces[first : min(first + _AHEAD, self._count)]
        a, ab = pieces[:, :2], pieces[:, 2:4] - pieces[:, :2]
        c, cd = arcs[:, :-1, None], np.diff(arcs, axis=1)[:, :, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            across = _cross(ab, cd)
            along = _cross(c - a, cd) / across
            on_arc = _cross(c - a, ab) / across
            low, high = -_ROUNDING, 1.0 + _ROUNDING
            hit = (along >= low) & (along <= high) & (on_arc >= low) & (on_arc <= high)
        chain, point, piece = np.nonzero(hit)
        length = pieces[piece, 4] + along[hit] * (pieces[piece, 5] - pieces[piece, 4])
        kept = length >= least
        return chain[kept], (point + on_arc[hit])[kept], length[kept]

    def _piece(self, a: Place, b: Place, begin: float, end: float) -> None:
        if self._count == len(self._pieces):
            self._pieces = np.concatenate([self._pieces, np.zeros_like(self._pieces)])
        folded = self.plane.fold(np.stack([a, b]))
        self._pieces[self._count] = [*folded[0], *folded[1], begin, end]
        self._count += 1


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


_FIRST, _LARGEST = 0.05, 4.0
"""Cells from the saddle to the first point, along the eigenvector; the longest step."""
_SMALLEST = 1e-3
"""Cells: at this step the curve may turn by any angle, as it does where the map has a corner: at a grazing."""
_LARGEST_ANGLE, _SMALLEST_ANGLE, _BEND = 0.3, 0.2, 0.1
"""A step is halved where the curve turns by more than the first, rad, or by more than the third, cells aside (step times angle), and
doubled where it turns by less than the second: the rules and the angles are those of Krauskopf and Osinga 1998."""
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
    plane: AbstractPlaneMap, saddle: Place, direction: Place, *, low: Place, high: Place, longest: float
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

    Returns:
        The curve from the saddle on, with a row of NaN where it passes a rigid stop, and whether it ended before the region and `longest`,
        for want of a next point.

    Source: J. P. England, B. Krauskopf, H. M. Osinga, Computing one-dimensional stable manifolds and stable sets of planar maps without
    the inverse, SIAM Journal on Applied Dynamical Systems 3 (2004) 161-190; several circles at once, ours.
    """
    curve = Traced(plane, saddle - _FIRST * direction, saddle)
    curve.add(saddle + _FIRST * direction)
    image = plane.image(np.array([curve.points[-1]]))[0]
    trail = [_Found(curve.points[-1], float(np.arctan2(direction[1], direction[0])), _FIRST, float((image - saddle) @ direction))]
    step = _FIRST
    for _ in range(_TRIES):
        if curve.lengths[-1] >= longest:
            return curve.path(), False
        found = _next(plane, curve, trail[-1], step)
        if found is None and trail[-1].step > _SMALLEST and len(trail) > 1:
            curve.remove()
            step = max(_BACK * trail.pop().step, _SMALLEST)
            continue
        found = found or _corner(plane, curve, trail[-1])
        if found is None:
            return curve.path(), True
        curve.add(found.point)
        here = plane.fold(found.point[None])[0]
        if np.any(here < low) or np.any(here > high):
            return curve.path(), False
        grows = abs(_turn(trail[-1], found)) < _SMALLEST_ANGLE
        step = float(np.clip(_GROWS * found.step if grows else found.step, _SMALLEST, _LARGEST))
        trail.append(found)
    return curve.path(), True


def _next(plane: AbstractPlaneMap, curve: Traced, last: _Found, step: float) -> _Found | None:
    """The next point at the longest step that turns little enough; None where there is none down to the shortest."""
    while step >= _SMALLEST:
        radii = np.unique(np.clip(step * np.array(_RADII), _SMALLEST, _LARGEST))[::-1]
        angles = np.broadcast_to(np.linspace(-_SPREAD, _SPREAD, _ANGLES), (len(radii), _ANGLES))
        arcs = _images(plane, last, radii, angles)
        coarse = [_nearest(curve, arc, last.length - _NOISE * _SMALLEST, last.length) for arc in arcs]
        for radius, arc, here, inner in zip(radii, arcs, coarse, [*coarse[1:], None], strict=True):
            on_the_way = inner is not None or radius <= _SMALLEST
            found = _refined(plane, curve, last, float(radius), angles[0], arc, here[0]) if here and on_the_way else None
            turn = 0.0 if found is None else abs(_turn(last, found))
            if found and turn <= _LARGEST_ANGLE and turn * radius <= _BEND and _follows(curve, last, found):
                return found
        step *= _RADII[-1]
    return None


def _corner(plane: AbstractPlaneMap, curve: Traced, last: _Found) -> _Found | None:
    """The next point whatever the curve turns by, on the smallest circle where the image goes on.

    Behind a grazing of a rigid stop the image goes on with the square of the distance alone.
    """
    angles, radius = np.linspace(-np.pi, np.pi, _ANGLES * len(_RADII)), _SMALLEST
    while radius <= _LARGEST:
        arc = _images(plane, last, np.array([radius]), angles[None])[0]
        _, positions, _ = curve.crossings(arc[None], last.length - radius)
        each = [_refined(plane, curve, last, radius, angles, arc, float(position)) for position in positions]
        ahead = [found for found in each if found and found.length > last.length + _NOISE * _SMALLEST]
        on = [found for found in ahead if _follows(curve, last, found)]
        if on:
            return min(on, key=lambda found: found.length)
        radius *= _GROWS
    return None


def _turn(last: _Found, found: _Found) -> float:
    """By how much the curve turns at the last point, rad."""
    return float(np.mod(found.heading - last.heading + np.pi, 2.0 * np.pi) - np.pi)


def _follows(curve: Traced, last: _Found, found: _Found) -> bool:
    """Whether the curve between the last image and this one is nearly straight, so that none of its bends was skipped."""
    apart = float(np.linalg.norm(curve.place(found.length) - curve.place(last.length)))
    return found.length - last.length <= _DETOUR * apart + 4.0 * _SMALLEST


def _nearest(curve: Traced, arc: np.ndarray, least: float, at: float) -> tuple[float, float] | None:
    """Position on an arc and length along the curve of the crossing that is next to a length."""
    _, positions, lengths = curve.crossings(arc[None], least)
    if not lengths.size:
        return None
    nearest = int(np.argmin(np.abs(lengths - at)))
    return float(positions[nearest]), float(lengths[nearest])


def _refined(
    plane: AbstractPlaneMap, curve: Traced, last: _Found, radius: float, angles: np.ndarray, arc: np.ndarray, position: float
) -> _Found | None:
    """The crossing on one circle, its angle refined until neighbouring images are near; None where it does not stay."""
    length = last.length
    for _ in range(_REFINEMENTS):
        number = min(int(position), len(angles) - 2)
        angles = np.linspace(angles[number], angles[number + 1], _ANGLES * len(_RADII))
        arc = _images(plane, last, np.array([radius]), angles[None])[0]
        here = _nearest(curve, arc, last.length - _NOISE * _SMALLEST, last.length)
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


_PIECES = 8
"""Of the straight line from the saddle's neighbourhood to its image."""
_IMAGES = 200
"""At most: so often a piece is mapped on."""
_TORN = 2.0 * _LARGEST
"""Spacing beyond which neighbours are no neighbours on the curve."""
_SPLIT = 1e-7
"""Cells: nearer points are not divided further; where their images lie apart the curve is broken, as at a rigid stop."""


def unstable_branch(
    plane: AbstractPlaneMap,
    saddle: Place,
    direction: Place,
    multiplier: float,
    *,
    low: Place,
    high: Place,
    longest: float,
) -> Curve:
    """One branch of the unstable manifold: the points that leave the saddle.

    The line along the eigenvector from a point near the saddle to its image is mapped on; where neighbouring images are too far apart, or
    the curve turns too much, a point is put between those that they are images of.

    Arguments:
        plane: the map, with the saddle as fixed point and a positive multiplier along `direction`.
        saddle: in cells.
        direction: unit vector along which the map stretches.
        multiplier: by how much, > 1.
        low: lower left corner of the region where the curve is sought, cells.
        high: upper right corner.
        longest: length at which it ends, cells.

    Returns:
        The curve from the saddle on, with a row of NaN where it is broken; it ends at the region's border, at `longest`, or on an
        attractor.

    Source: D. Hobson, An efficient method for computing invariant manifolds of planar maps, Journal of Computational Physics 104 (1993)
    14-22; spacing as in B. Krauskopf, H. M. Osinga, Growing 1D and quasi-2D unstable manifolds of maps, Journal of Computational Physics
    146 (1998) 404-419.
    """
    near = saddle + _FIRST / multiplier * direction
    piece = np.linspace(near, plane.image(near[None])[0], _PIECES + 1)
    curve, length = [saddle[None], piece], 0.0
    for _ in range(_IMAGES):
        piece, image = _image(plane, piece, longest - length)
        outside = np.flatnonzero(np.isnan(image[:, 0]) | np.any((image < low) | (image > high), axis=1))
        image = image[: outside[0]] if outside.size else image
        if len(image) < 2:
            break
        gaps = np.linalg.norm(np.diff(image, axis=0), axis=1)
        torn = gaps > _TORN
        curve.append(np.insert(image, 1 + np.flatnonzero(torn), np.nan, axis=0)[1:])
        grown = float(gaps[~torn].sum())
        length += grown
        if length >= longest or grown < _SMALLEST:
            break
        piece = _thinned(image)
    return np.concatenate(curve)


def _thinned(piece: Curve) -> Curve:
    """Without every other point whose neighbours are so near that the curve is as well known without it."""
    near = np.linalg.norm(piece[2:] - piece[:-2], axis=1) < _BEND
    between = np.linalg.norm(piece[1:-1] - piece[:-2], axis=1) + np.linalg.norm(piece[2:] - piece[1:-1], axis=1) < _BEND
    dropped = np.concatenate([[False], near & between & (np.arange(len(near)) % 2 == 0), [False]])
    return piece[~dropped]


def _image(plane: AbstractPlaneMap, piece: Curve, room: float) -> tuple[Curve, Curve]:
    """A piece with points put in between, and its image; no longer than there is room for."""
    image = plane.image(piece)
    while True:
        chords = np.diff(image, axis=0)
        gaps = np.linalg.norm(chords, axis=1)
        end = int(np.searchsorted(np.cumsum(np.nan_to_num(np.where(gaps > _TORN, 0.0, gaps))), room)) + 2
        piece, image, chords, gaps = piece[:end], image[:end], chords[: end - 1], gaps[: end - 1]
        heading = np.arctan2(chords[:, 1], chords[:, 0])
        turn = np.abs(np.mod(np.diff(heading) + np.pi, 2.0 * np.pi) - np.pi)
        wide = gaps > _LARGEST
        wide[1:] |= turn * gaps[1:] > _BEND
        wide[:-1] |= turn * gaps[:-1] > _BEND
        wide &= np.linalg.norm(np.diff(piece, axis=0), axis=1) > _SPLIT
        where = np.flatnonzero(wide)
        if not where.size:
            return piece, image
        between = 0.5 * (piece[where] + piece[where + 1])
        piece, image = np.insert(piece, where + 1, between, axis=0), np.insert(image, where + 1, plane.image(between), axis=0)
