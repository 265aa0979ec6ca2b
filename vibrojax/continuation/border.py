"""Borders in the plane of two parameters: curves along which an orbit folds, doubles its period, or grazes the stop."""

import dataclasses
from collections.abc import Callable, Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Float

from vibrojax.continuation.branch import Branch, Coordinates, End, Kind, SpecialPoint, comma_separated, null_vector, sizes_of
from vibrojax.continuation.orbit import flip_test, fold_test, landing_of, map_with_jacobian, solved
from vibrojax.continuation.rig import SETTINGS, ForcedRig, Passage, as_arrays
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import Landing

Bounds = tuple[float, float]
_CLEARANCE = 1e-5
"""Distance over A0 between the stop and an orbit that counts as grazing: just short of the impact the map is still smooth."""
_DIFFERENCE = 1e-7
"""Step of the central differences, in scaled coordinates."""
_CLOSED, _STILL, _ITERATIONS = 1e-9, 1e-7, 10
"""Closing error, and length of the last Newton step, of a point of the border; most Newton steps."""
_STRAIGHT = 0.97
"""Least cosine between a chord and the tangents at its ends."""
_FIRST, _LONGEST, _SHORTEST, _LONGER, _SHORTER = 1e-2, 4e-2, 1e-5, 1.4, 0.5
"""Lengths of steps, with the ranges of both parameters as one, and their changes."""
_REACH = 1e-3
"""Of the ranges: a special point so near to a border lies on it."""
_BACK = 8
"""Points after which a border may close on itself."""


class Border(eqx.Module):
    """One border: where orbits of one family change, as a curve in the plane of two parameters."""

    kind: Kind = eqx.field(static=True)
    names: tuple[str, str] = eqx.field(static=True)
    """Of the parameters."""
    labels: tuple[str, str] = eqx.field(static=True)
    """Symbols and units of the parameters."""
    cycles: int = eqx.field(static=True)
    """Period of the orbits in periods of the cart."""
    touches: int = eqx.field(static=True)
    """Impacts in one period; at a grazing without the grazing one."""
    first: Float[np.ndarray, " points"]
    second: Float[np.ndarray, " points"]
    states: Float[np.ndarray, "points states"]
    """(u, u', ...) at the section, m and m/s."""
    ends: tuple[End, End] = eqx.field(static=True)
    settings: tuple[tuple[str, float], ...] = eqx.field(static=True)
    """Name and value of what is set on the rig and is none of the two parameters."""

    def holds(self, first: float, second: float, reach: Bounds) -> bool:
        """Whether a point lies on the border, to a part of `reach` in either parameter."""
        x, y = (self.first - first) / reach[0], (self.second - second) / reach[1]
        x, y = (np.append(part, part[-1]) for part in (x, y))
        dx, dy = np.diff(x), np.diff(y)
        along = np.clip(-(x[:-1] * dx + y[:-1] * dy) / np.maximum(dx**2 + dy**2, 1e-300), 0.0, 1.0)
        return bool(np.any(np.hypot(x[:-1] + along * dx, y[:-1] + along * dy) < 1.0))

    def columns(self) -> dict[str, np.ndarray]:
        """The border as columns of a plain table: one row a point."""
        count = len(self.first)
        return {
            "kind": np.full(count, self.kind.value),
            "cycles": np.full(count, self.cycles),
            "touches": np.full(count, self.touches),
            self.names[0]: self.first,
            self.names[1]: self.second,
            **{name: np.full(count, value) for name, value in self.settings},
            "u_m": self.states[:, 0],
            "v_m_per_s": self.states[:, 1],
        }


def border(place: SpecialPoint, names: tuple[str, str], bounds: tuple[Bounds, Bounds], *, landing: Landing | None = None) -> Border:
    """Follow a special point of a branch in two parameters, both ways, by pseudo-arclength continuation.

    The curve is P^p(x; a, b) = x with one more condition: det(M - 1) = 0 at a fold, det(M + 1) = 0 where the period doubles, a clearance
    of 1e-5 A0 at a grazing. Its derivatives are central differences of the map and of its monodromy matrix M.

    Arguments:
        place: a fold, period doubling or grazing.
        names: of the two parameters, as for `follow`; the branch was followed along the first.
        bounds: of both, SI.
        landing: the integrator.

    Raises:
        InputError: a special point of another kind, one parameter twice, or bounds that do not hold the point.
        NoConvergenceError: the point itself is not on a border.

    Source: W. J. F. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM (2000), ch. 4 (folds and flips of maps as
    zeros of a determinant); grazing as a zero of the clearance: P. Thota, H. Dankowicz, SIAM J. Appl. Dyn. Syst. 7 (2008) 1283-1322.
    """
    if place.kind not in _TESTS:
        raise InputError(f"a {place.kind.value} is no border that is followed: expected one of {', '.join(kind.value for kind in _TESTS)}")
    rig = as_arrays(place.orbit.rig)
    here = tuple(float(rig.value(name)) for name in names)
    if names[0] == names[1]:
        raise InputError(f"both parameters of a border are {names[0]}: expected two; change one of them")
    for name, value, (low, high) in zip(names, here, bounds, strict=True):
        if not low < high or not low <= value <= high:
            raise InputError(f"{name} runs from {low:g} to {high:g}, the border begins at {value:g}: expected a range that holds it")
    scale = np.array([*sizes_of(place.orbit), *(high - low for low, high in bounds)])
    landing = landing_of(rig) if landing is None else landing
    surface = _Surface(rig, names, place.orbit.cycles, place.orbit.touches, place.kind, landing, scale)
    guess = np.array([*place.orbit.state, *here]) / scale
    start = surface.corrected(guess, np.eye(len(guess))[-1], where=f"{names[1]} = {here[1]:g}")
    limits = np.array(bounds) / scale[-2:, None]
    forward = _arm(surface, start, limits)
    backward = ([start], End.CLOSED) if forward[1] is End.CLOSED else _arm(surface, (start[0], -start[1]), limits)
    z = np.array([point for point, _ in (*reversed(backward[0][1:]), *forward[0])]) * scale
    labels = (rig.label(names[0]), rig.label(names[1]))
    return Border(
        kind=place.kind,
        names=names,
        labels=labels,
        cycles=place.orbit.cycles,
        touches=place.orbit.touches,
        first=z[:, -2],
        second=z[:, -1],
        states=z[:, :-2],
        ends=(backward[1], forward[1]),
        settings=tuple((name, float(rig.value(name))) for name in SETTINGS if name not in names),
    )


_Point = tuple[Coordinates, Coordinates]
"""Scaled coordinates (state, first and second parameter), and the unit tangent."""


@dataclasses.dataclass(frozen=True)
class _Surface:
    """The conditions that hold on one border, in scaled coordinates."""

    rig: ForcedRig
    names: tuple[str, str]
    cycles: int
    touches: int
    kind: Kind
    landing: Landing
    scale: Coordinates

    def corrected(self, guess: Coordinates, normal: Coordinates, *, where: str = "the next step") -> _Point:
        """The point of the border on the plane through a guess, by Newton's method."""
        z, moved = guess, np.inf
        for _ in range(_ITERATIONS):
            error = self.conditions(z)
            steps = _DIFFERENCE * np.eye(len(z))
            jacobian = np.stack([(self.conditions(z + step) - self.conditions(z - step)) / (2.0 * _DIFFERENCE) for step in steps], axis=1)
            if np.max(np.abs(error[:-1])) < _CLOSED and moved < _STILL:
                return z, null_vector(jacobian)
            step = solved(np.vstack([jacobian, normal]), np.append(error, normal @ (z - guess)))
            z, moved = z - step, float(np.linalg.norm(step))
            if not moved < 1.0:
                break
        raise NoConvergenceError(f"no {self.kind.value} found at {where}")

    def conditions(self, z: Coordinates) -> Float[np.ndarray, " conditions"]:
        """Closing error over the scale of the states, and the test of the kind."""
        state, rig = z[:-2] * self.scale[:-2], self.rig
        for name, value in zip(self.names, z[-2:] * self.scale[-2:], strict=True):
            rig = rig.replace(name, float(value))
        rig = as_arrays(rig)
        reached, full, passage = map_with_jacobian(self.landing, rig, self.names[0], self.cycles, state)
        return np.append((reached - state) / self.scale[:-2], _TESTS[self.kind](rig, full[:, :-1], passage, self.touches))


def _grazes(rig: ForcedRig, _: np.ndarray, passage: Passage, touches: int) -> float:
    """Zero where the orbit misses the stop by `_CLEARANCE`: minus its smallest distance from the stop over A0, plus that.

    An orbit with an impact more than the border's has passed the grazing: half the square of its slowest impact over A0 Omega says how far.
    """
    amplitude = float(rig.base_amplitude)
    if int(passage.touches) > touches:
        return 0.5 * (float(passage.slowest_touch) / (2.0 * np.pi * float(rig.frequency_hz) * amplitude)) ** 2 + _CLEARANCE
    return float(passage.closest) / amplitude + _CLEARANCE


_TESTS: dict[Kind, Callable[[ForcedRig, np.ndarray, Passage, int], float]] = {
    Kind.FOLD: lambda rig, monodromy, passage, touches: fold_test(monodromy),
    Kind.PERIOD_DOUBLING: lambda rig, monodromy, passage, touches: flip_test(monodromy),
    Kind.GRAZING: _grazes,
    Kind.GRAZING_FOLD: _grazes,
}


FOLLOWED = tuple(_TESTS)
"""Kinds of special points that lie on borders which are followed."""


def _arm(surface: _Surface, start: _Point, limits: Float[np.ndarray, "2 2"], most_points: int = 1000) -> tuple[list[_Point], End]:
    """Points from the start on along its tangent, and why there are no more."""
    points, h = [start], _FIRST
    while len(points) < most_points:
        z, tangent = points[-1]
        new = _next(surface, points[-1], h)
        if new is None:
            h *= _SHORTER
            if h < _SHORTEST:
                return points, End.LOST
            continue
        h = min(h * _LONGER, _LONGEST)
        bound = np.clip(new[0][-2:], *limits.T)
        if np.any(bound != new[0][-2:]):
            last = _at_bound(surface, z, new[0], bound)
            return ([*points, last], End.BOUND) if last is not None else (points, End.LOST)
        points.append(new)
        back = float(np.linalg.norm((new[0] - start[0])[-2:]))
        if len(points) > _BACK and back < h and float(new[1] @ start[1]) > _STRAIGHT:
            return points, End.CLOSED
    return points, End.POINTS


def _next(surface: _Surface, last: _Point, h: float) -> _Point | None:
    """The point a step further; None where there is none near, or the border bends too much in between."""
    z, tangent = last
    try:
        found, ahead = surface.corrected(z + h * tangent, tangent)
    except NoConvergenceError:
        return None
    chord = found - z
    length = float(np.linalg.norm(chord))
    if not 0.0 < length < 3.0 * h:
        return None
    ahead = ahead if ahead @ chord >= 0 else -ahead
    return (found, ahead) if min(ahead @ chord, tangent @ chord) >= _STRAIGHT * length else None


def _at_bound(surface: _Surface, last: Coordinates, new: Coordinates, bound: Float[np.ndarray, " 2"]) -> _Point | None:
    """The point between two points at which the border leaves the ranges; None where none is found. `bound` is the second, clipped."""
    here, there = last[-2:], new[-2:]
    leaves = bound != there
    parts = np.where(leaves, (bound - here) / np.where(leaves, there - here, 1.0), np.inf)
    axis = int(np.argmin(parts))
    try:
        return surface.corrected(last + parts[axis] * (new - last), np.eye(len(last))[len(last) - 2 + axis])
    except NoConvergenceError:
        return None


def borders(
    branch: Branch,
    along: str,
    bounds: tuple[Bounds, Bounds],
    *,
    landing: Landing | None = None,
    progress: Callable[[str], None] = lambda stage: None,
) -> tuple[list[Border], list[str]]:
    """Follow every fold, period doubling and grazing of a branch in a second parameter; those on one border are followed once.

    Arguments:
        branch: as followed along its own parameter.
        along: name of the second parameter.
        bounds: of both parameters, SI.
        landing: the integrator.
        progress: called with each special point.

    Returns:
        The borders, and a sentence on each special point from which none could be followed.
    """
    found: list[Border] = []
    lost: list[str] = []
    reach = (_REACH * (bounds[0][1] - bounds[0][0]), _REACH * (bounds[1][1] - bounds[1][0]))
    for place in branch.special:
        here = float(place.orbit.rig.value(along))
        known = (one for one in found if one.kind is place.kind)
        if place.kind not in FOLLOWED or any(one.holds(place.parameter, here, reach) for one in known):
            continue
        progress(f"following the {place.kind.value} at {place.parameter:.4g} along {along}")
        try:
            found.append(border(place, (branch.name, along), bounds, landing=landing))
        except NoConvergenceError as error:
            lost.append(f"{place.kind.value} at {place.parameter:.6g}: {error}")
    return found, lost


def border_table(found: Sequence[Border]) -> str:
    """All borders of a branch as comma-separated text with a header, numbered in the first column."""
    tables = [{"border": np.full(len(one.first), number)} | one.columns() for number, one in enumerate(found, 1)]
    return comma_separated({name: np.concatenate([table[name] for table in tables]) for name in tables[0]})
