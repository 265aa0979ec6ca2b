"""From one branch to another: past a grazing at which a branch has a corner, and to orbits of twice the period where they are born."""

import dataclasses

import numpy as np

from vibrojax.continuation.arclength import Curve, Point, curve_through
from vibrojax.continuation.orbit import Orbit, landing_of, map_with_jacobian
from vibrojax.continuation.special import Kind, SpecialPoint
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import Landing

_BEYOND = 10.0 ** np.arange(-7.0, -1.5, 0.5)
_NEAR = 20.0


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
    for reach in _BEYOND:
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
            if abs(int(new.passage.touches) - touches) == 1 and 0.0 < np.linalg.norm(offset) < _NEAR * reach:
                return dataclasses.replace(new, tangent=new.tangent * (1.0 if new.tangent @ offset >= 0 else -1.0))
    return None


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
            found = double.orbit(double.corrected(z + reach * normal, normal))
            halfway, _, _ = map_with_jacobian(landing, found.rig, name, orbit.cycles, found.state)
        except NoConvergenceError:
            continue
        if np.linalg.norm((halfway - found.state) / single.scale[:-1]) > _OTHER * reach:
            return found
    raise NoConvergenceError(f"no orbit of {2 * orbit.cycles} cycles found near the period doubling at {name} = {place.parameter:g}")
