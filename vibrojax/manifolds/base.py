"""A map of the plane, of which saddles and their manifolds are sought.

Points are measured in cells of a picture of the plane, so that every length (steps along a curve, errors, distances from a boundary) is a
number of cells.

To add one: write a file with a final subclass of `AbstractPlaneMap` that implements `image`, and `fold` where its plane has an edge.
"""

import abc

import equinox as eqx
import numpy as np
from jaxtyping import Float

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
