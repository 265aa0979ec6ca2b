"""A curve that grows point by point, and where other curves cross it."""

import numpy as np
from jaxtyping import Float, Int

from vibrojax.manifolds.base import AbstractPlaneMap, Curve, Place

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
