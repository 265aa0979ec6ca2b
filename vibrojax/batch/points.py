"""What a batch is asked and what it answers: operating points on labelled axes, and responses of their shape."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.batch.base import Lanes, LaneState
from vibrojax.contact import NOWHERE, AbstractInstantaneousLaw, NoContact
from vibrojax.errors import InputError
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate.base import RESULT_MESSAGES, SUCCESS
from vibrojax.model import MASS, Model
from vibrojax.system import System

SETTINGS = {
    "frequency_hz": ("Hz", "excitation frequency"),
    "base_amplitude": ("m", "amplitude of the cart, A0"),
    "base_phase": ("rad", "phase of the cart at the strobe"),
    "gap": ("m", "gap"),
    "u0": ("m", "initial displacement of the hammer relative to the cart"),
    "v0": ("m/s", "initial velocity of the hammer relative to the cart"),
}
"""What an operating point sets beside the model's parameters: unit and meaning."""
STILL = 1e-3
"""m; what sections are measured by where the cart is at rest."""
LONG_SINCE = 1e-12
"""s since the touch of what starts inside the stop: it did not touch it now."""
_NEEDED = ("frequency_hz", "base_amplitude", "gap")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Points:
    """Operating points on labelled axes.

    Attributes:
        coords: values along each axis, in the order of the axes.
        values: what each point sets, by name (`SETTINGS`, a parameter of the model, or `m`): arrays that broadcast to the axes' shape.

    Example:
        >>> points = grid({"gap": [0.0, 1e-3], "frequency_hz": [4.0, 5.0, 6.0]}, base_amplitude=2e-3)
        >>> points.shape, points.lanes
        ((2, 3), 6)
    """

    coords: Mapping[str, np.ndarray]
    values: Mapping[str, Any]

    @property
    def shape(self) -> tuple[int, ...]:
        """Count of points along each axis."""
        return tuple(len(values) for values in self.coords.values())

    @property
    def lanes(self) -> int:
        """Count of points."""
        return int(np.prod(self.shape))

    def flat(self) -> dict[str, np.ndarray]:
        """What each point sets, one array of all points a name."""
        return {name: np.broadcast_to(np.asarray(value, dtype=float), self.shape).reshape(-1) for name, value in self.values.items()}

    def chosen(self, index: np.ndarray) -> "Points":
        """Some of the points, one after the other on the axis `lane`; `index` counts them as `flat` does."""
        return Points(coords={"lane": index.astype(float)}, values={name: part[index] for name, part in self.flat().items()})


def grid(axes: Mapping[str, Any], **fixed: float) -> Points:
    """Every combination of the values on some axes.

    Arguments:
        axes: values by name, SI; names as in `SETTINGS`, or of the model's parameters, or `m`.
        fixed: what is the same at every point.

    Raises:
        InputError: an axis is empty, not one-dimensional, holds what is not a finite number, or is also given as a fixed value.
    """
    if both := sorted(set(axes) & set(fixed)):
        raise InputError(f"{both[0]} is given both as an axis and as a fixed value: expected one of the two; leave one out")
    coords = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in axes.items()}
    for name, values in coords.items():
        if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
            raise InputError(f"axis {name} has shape {values.shape}, or holds numbers that are not finite: give a list of finite numbers")
    mesh = np.meshgrid(*coords.values(), indexing="ij", sparse=True)
    return Points(coords=coords, values=dict(zip(coords, mesh, strict=True)) | fixed)


def lanes_of(model: Model, points: Points) -> tuple[Lanes, LaneState]:
    """The rigs of all points, and their states at t = 0: at rest in the cart where u0 and v0 are left out.

    Effects that belong to a recorder or to one record alone (`Model.rig`) are left out.

    Raises:
        InputError: a point sets what the model does not have, leaves out what it needs, or is out of range.
    """
    values, model = points.flat(), model.rig
    _check(model, values)
    full = {name: jnp.asarray(values.get(name, np.zeros(points.lanes))) for name in SETTINGS}
    chosen = {name: jnp.asarray(value) for name, value in values.items() if name not in SETTINGS}
    base = Harmonic(full["base_amplitude"], full["base_phase"], full["frequency_hz"])
    gap = jnp.full(points.lanes, NOWHERE) if isinstance(model.law, NoContact) else full["gap"]
    system = model.replace(chosen).system(gap=gap, base=base, applied=Unforced())
    systems = jax.tree.map(lambda leaf: jnp.broadcast_to(jnp.asarray(leaf, dtype=float), (points.lanes,)), system)
    if isinstance(model.law, AbstractInstantaneousLaw) and bool(jnp.any(full["u0"] > jnp.asarray(systems.gap))):
        raise InputError("u0 lies behind a rigid stop: expected u0 <= gap; move the start or the stop")
    return Lanes(systems, full["frequency_hz"]), state_at(systems, full["u0"], full["v0"])


def state_at(systems: System, u: Float[Array, " lanes"], v: Float[Array, " lanes"]) -> LaneState:
    """Lanes at t = 0 with the states of their effects at zero; what starts inside a stop is in contact, since long.

    Arguments:
        systems: the rigs, one a lane.
        u: displacement, m.
        v: velocity, m/s; where in contact its size stands for the approach speed, which a state does not hold.
    """
    touching, nothing = u > jnp.asarray(systems.gap), jnp.zeros_like(u)
    return LaneState(
        u=u,
        v=v,
        in_contact=touching,
        approach_speed=jnp.abs(v),
        since_touch=jnp.where(touching, LONG_SINCE, nothing),
        cycle=jnp.zeros(u.shape, int),
        own=jnp.zeros((*u.shape, systems.own_size)),
    )


def _check(model: Model, values: Mapping[str, np.ndarray]) -> None:
    known = [*SETTINGS, MASS.name, *model.values()]
    for name, value in values.items():
        if name not in known:
            raise InputError(f"unknown setting {name!r}: expected one of {', '.join(known)}")
        if not np.all(np.isfinite(value)):
            raise InputError(f"{name} holds numbers that are not finite: expected finite numbers; correct the axis")
    for name in _NEEDED:
        if name not in values:
            raise InputError(f"{name} is given neither as an axis nor as a fixed value: expected one of the two; add it")
    for p in model.parameters:
        for value in np.unique(values.get(p.name, np.zeros(0))):
            if expected := p.refusal(value):
                raise InputError(f"{p.name} is {value:g} somewhere: expected {expected}; correct the axis")
    for name in ("frequency_hz", MASS.name, "base_amplitude"):
        least = values[name].min() if name in values else np.inf
        if least < 0 or (least == 0 and name != "base_amplitude"):
            expected = "of at least 0" if name == "base_amplitude" else "above 0"
            raise InputError(f"{name} is {least:g} somewhere: expected numbers {expected}; correct the axis")


def section_scales(base_amplitude: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """Sizes by which section points (u, u') are measured: A0 and A0 Omega, along the first axis of what comes back."""
    size = np.where(base_amplitude > 0, base_amplitude, STILL)
    return np.stack(np.broadcast_arrays(size, size * 2.0 * np.pi * frequency_hz))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Responses:
    """Recorded cycles of every operating point; `*axes` is the shape of the points.

    Attributes:
        coords: values along each axis.
        u: displacement at the strobe that ends each recorded cycle, m, `(*axes, cycle)`.
        v: velocity there, m/s.
        impacts: touches that began in the cycle.
        peak_force: largest push of the stop in the cycle, N.
        impact_speed: fastest approach in the cycle, m/s.
        u_max: largest displacement in the recorded cycles, m; of the fast path, also in up to three flights before them, `(*axes,)`.
        closed: cycles after which the orbit was seen to repeat itself, and integration stopped; 0 where it did not.
        cycles: integrated, `(*axes,)`.
        result: `SUCCESS` or why the lane stopped, a code of `vibrojax.integrate.base`.
        state: of every lane at the end, lanes in the order of the flattened axes.
        engine: its name.
        seconds: time of the integration, without compiling if it was compiled before.
    """

    coords: Mapping[str, np.ndarray]
    u: np.ndarray
    v: np.ndarray
    impacts: np.ndarray
    peak_force: np.ndarray
    impact_speed: np.ndarray
    u_max: np.ndarray
    closed: np.ndarray
    cycles: np.ndarray
    result: np.ndarray
    state: LaneState
    engine: str
    seconds: float

    @property
    def failures(self) -> dict[str, int]:
        """`failures` of its lanes."""
        return failures(self.result)


def failures(result: np.ndarray) -> dict[str, int]:
    """Count of operating points by why they stopped short, from their codes; empty where all went through."""
    codes, counts = np.unique(result[result != SUCCESS], return_counts=True)
    return {RESULT_MESSAGES[int(code)]: int(count) for code, count in zip(codes, counts, strict=True)}
