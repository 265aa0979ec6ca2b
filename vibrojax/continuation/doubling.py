"""Orbits of twice the period, from the point at which they are born."""

import numpy as np

from vibrojax.continuation.arclength import Curve, curve_through
from vibrojax.continuation.orbit import Orbit, landing_of, map_with_jacobian
from vibrojax.continuation.special import Kind, SpecialPoint
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import Landing

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
