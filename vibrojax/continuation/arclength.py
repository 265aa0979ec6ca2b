"""Points of a branch, and the correction that brings a guess back onto it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from vibrojax.continuation.multipliers import multipliers
from vibrojax.continuation.orbit import Orbit, map_with_jacobian, solved, state_scale
from vibrojax.continuation.rig import ForcedRig, as_arrays
from vibrojax.continuation.stroboscope import Passage
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
    """Of length one; the caller chooses its sense."""
    passage: Passage
    corrections: int
    """Newton steps that it took."""


@dataclasses.dataclass(frozen=True)
class Curve:
    """The curve P^p(x; parameter) = x of one family of orbits in scaled coordinates.

    Arguments:
        rig: the rig, all numbers but one of which stay.
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
                return Point(z, monodromy, _null_vector(jacobian), passage, corrections)
            if not error < _WORSE * last:
                break
            bordered = np.vstack([jacobian, normal])
            z = z - solved(bordered, np.append(gap, normal @ (z - guess)))
            last = error
        raise NoConvergenceError(f"no orbit on the plane through {self.name} = {guess[-1] * self.scale[-1]:g}: closing error {error:.1e}")

    def tangent_at(self, z: Coordinates) -> tuple[Coordinates, int]:
        """Unit vector along which the closing error does not change, at a point that need not be on the curve, and its impacts."""
        _, jacobian, _, passage = self._closing(z)
        return _null_vector(jacobian), int(passage.touches)

    def start(self, orbit: Orbit) -> Point:
        """The point of a given orbit."""
        z = np.append(orbit.state, float(self.rig.value(self.name))) / self.scale
        return self.corrected(z, _along_parameter(z))

    def at_parameter(self, guess: Coordinates) -> Point:
        """The point with the parameter of the guess."""
        return self.corrected(guess, _along_parameter(guess))

    def rig_at(self, point: Point) -> ForcedRig:
        """The rig with the parameter of a point."""
        return as_arrays(self.rig.replace(self.name, float(point.z[-1] * self.scale[-1])))

    def orbit(self, point: Point) -> Orbit:
        """The orbit of a point."""
        return Orbit(self.rig_at(point), self.cycles, point.z[:-1] * self.scale[:-1], point.monodromy, point.passage)

    def multipliers(self, point: Point) -> np.ndarray:
        """Floquet multipliers of a point."""
        return multipliers(point.monodromy)

    def _closing(self, z: Coordinates):
        """Closing error and its Jacobian in scaled coordinates; monodromy matrix in SI; passage."""
        state = z[:-1] * self.scale[:-1]
        rig = as_arrays(self.rig.replace(self.name, float(z[-1] * self.scale[-1])))
        reached, full, passage = map_with_jacobian(self.landing, rig, self.name, self.cycles, state)
        jacobian = (full - np.eye(*full.shape)) * self.scale / self.scale[:-1, None]
        return (reached - state) / self.scale[:-1], jacobian, full[:, :-1], passage


def curve_through(orbit: Orbit, name: str, span: float, landing: Landing) -> Curve:
    """The curve through an orbit along one parameter; `span` is the range of the parameter that counts as one."""
    sizes = state_scale(orbit.rig)
    sizes[:2] *= max(sizes[0], abs(float(orbit.rig.gap)), float(orbit.passage.highest), -float(orbit.passage.lowest)) / sizes[0]
    return Curve(as_arrays(orbit.rig), name, orbit.cycles, landing, np.append(sizes, span))


def _along_parameter(z: Coordinates) -> Coordinates:
    normal = np.zeros_like(z)
    normal[-1] = 1.0
    return normal


def _null_vector(jacobian: Float[np.ndarray, "states coordinates"]) -> Coordinates:
    """Unit vector that the Jacobian maps to nothing."""
    return np.linalg.svd(jacobian)[2][-1]
