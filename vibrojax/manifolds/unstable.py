"""The unstable manifold of a saddle, grown by mapping a piece of it on and on."""

import numpy as np

from vibrojax.manifolds.base import AbstractPlaneMap, Curve, Place
from vibrojax.manifolds.stable import Steps

_PIECES = 8
"""Of the straight line from the saddle's neighbourhood to its image."""
_IMAGES = 200
"""At most: so often a piece is mapped on."""
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
    steps: Steps | None = None,
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
        steps: spacing.

    Returns:
        The curve from the saddle on, with a row of NaN where it is broken; it ends at the region's border, at `longest`, or on an
        attractor.

    Source: D. Hobson, An efficient method for computing invariant manifolds of planar maps, Journal of Computational Physics 104 (1993)
    14-22; spacing as in B. Krauskopf, H. M. Osinga, Growing 1D and quasi-2D unstable manifolds of maps, Journal of Computational Physics
    146 (1998) 404-419.
    """
    steps = Steps() if steps is None else steps
    near = saddle + steps.first / multiplier * direction
    piece = np.linspace(near, plane.image(near[None])[0], _PIECES + 1)
    curve, length = [saddle[None], piece], 0.0
    for _ in range(_IMAGES):
        piece, image = _image(plane, piece, steps, longest - length)
        outside = np.flatnonzero(np.isnan(image[:, 0]) | np.any((image < low) | (image > high), axis=1))
        image = image[: outside[0]] if outside.size else image
        if len(image) < 2:
            break
        gaps = np.linalg.norm(np.diff(image, axis=0), axis=1)
        torn = gaps > _torn(steps)
        curve.append(np.insert(image, 1 + np.flatnonzero(torn), np.nan, axis=0)[1:])
        grown = float(gaps[~torn].sum())
        length += grown
        if length >= longest or grown < steps.smallest:
            break
        piece = _thinned(image, steps)
    return np.concatenate(curve)


def _thinned(piece: Curve, steps: Steps) -> Curve:
    """Without every other point whose neighbours are so near that the curve is as well known without it."""
    near = np.linalg.norm(piece[2:] - piece[:-2], axis=1) < steps.bend
    between = np.linalg.norm(piece[1:-1] - piece[:-2], axis=1) + np.linalg.norm(piece[2:] - piece[1:-1], axis=1) < steps.bend
    dropped = np.concatenate([[False], near & between & (np.arange(len(near)) % 2 == 0), [False]])
    return piece[~dropped]


def _torn(steps: Steps) -> float:
    """Spacing beyond which neighbours are no neighbours on the curve."""
    return 2.0 * steps.largest


def _image(plane: AbstractPlaneMap, piece: Curve, steps: Steps, room: float) -> tuple[Curve, Curve]:
    """A piece with points put in between, and its image; no longer than there is room for."""
    image = plane.image(piece)
    while True:
        chords = np.diff(image, axis=0)
        gaps = np.linalg.norm(chords, axis=1)
        end = int(np.searchsorted(np.cumsum(np.nan_to_num(np.where(gaps > _torn(steps), 0.0, gaps))), room)) + 2
        piece, image, chords, gaps = piece[:end], image[:end], chords[: end - 1], gaps[: end - 1]
        heading = np.arctan2(chords[:, 1], chords[:, 0])
        turn = np.abs(np.mod(np.diff(heading) + np.pi, 2.0 * np.pi) - np.pi)
        wide = gaps > steps.largest
        wide[1:] |= turn * gaps[1:] > steps.bend
        wide[:-1] |= turn * gaps[:-1] > steps.bend
        wide &= np.linalg.norm(np.diff(piece, axis=0), axis=1) > _SPLIT
        where = np.flatnonzero(wide)
        if not where.size:
            return piece, image
        between = 0.5 * (piece[where] + piece[where + 1])
        piece, image = np.insert(piece, where + 1, between, axis=0), np.insert(image, where + 1, plane.image(between), axis=0)
