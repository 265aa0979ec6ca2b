"""The stroboscopic map of a rig on the plane of (u, u'), for many states side by side."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from vibrojax.batch import AbstractEngine, Points, engine_for
from vibrojax.batch.base import Lanes
from vibrojax.batch.points import lanes_of, state_at
from vibrojax.compiling import compiled_for_long_runs
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.continuation.rig import ForcedRig
from vibrojax.errors import InputError
from vibrojax.integrate.base import SUCCESS
from vibrojax.manifolds.base import AbstractPlaneMap, Place, Plane
from vibrojax.model import Model

_LANES = 64
"""Stepped side by side: those of `vibrojax.batch.integrate`."""


class StrobeMap(AbstractPlaneMap):
    """P^q: (u, u') when the cart passes its middle -> the same q cycles later.

    Behind a rigid stop there is no state. The plane is continued there by the states between which an impact jumps: u > gap with u' > 0
    stands for 2 gap - u with -e u', and with u' < 0 for 2 gap - u with the velocity before such a rebound. So a curve passes through
    an impact at the strobe without a break (Ivanov 1993 removes the jump by the same reflection).

    A contact law that depends on the speed of its touch has, in contact at the strobe, a state that (u, u') do not hold: |u'| stands for
    that speed, as for the initial states of a basin.

    Arguments:
        rig: model, gap, A0 and frequency.
        cycles: q.
        origin: (u, u') of the point (0, 0), m and m/s.
        cell: sides of a cell, m and m/s.

    Raises:
        InputError: an effect has a state of its own, so that states are no plane.
    """

    rig: ForcedRig
    lanes: Lanes
    engine: AbstractEngine
    cycles: int = eqx.field(static=True)
    origin: Place
    cell: Place

    def __init__(self, rig: ForcedRig, cycles: int, origin: Place, cell: Place):
        check_plane(rig.model)
        setting = {"frequency_hz": rig.frequency_hz, "gap": rig.gap, "base_amplitude": rig.base_amplitude}
        points = Points(coords={"lane": np.arange(float(_LANES))}, values=setting | {"u0": min(0.0, float(rig.gap))})
        self.rig, self.cycles, self.origin, self.cell = rig, cycles, origin, cell
        self.lanes, _ = lanes_of(rig.model, points)
        self.engine = engine_for(self.lanes)

    def image(self, points: Plane) -> Plane:
        """See `AbstractPlaneMap`."""
        state = self.states(self.fold(points))
        found = [self._chunk(state[i : i + _LANES]) for i in range(0, len(state), _LANES)]
        return (np.concatenate(found or [state]) - self.origin) / self.cell

    def states(self, points: Plane) -> Plane:
        """(u, u') of points, m and m/s."""
        return self.origin + points * self.cell

    def fold(self, points: Plane) -> Plane:
        """See `AbstractPlaneMap`."""
        law = self.rig.model.law
        if not isinstance(law, AbstractInstantaneousLaw):
            return points
        u, v = self.states(points).T
        gap, speed = float(self.rig.gap), np.abs(v)
        after = np.asarray(law.rebound_speed(jnp.asarray(speed)))
        before = speed**2 / np.where(after > 0, after, 1.0)
        mirrored = np.stack([2.0 * gap - u, np.where(v > 0, -after, before)], axis=-1)
        return np.where((u > gap)[:, None], (mirrored - self.origin) / self.cell, points)

    @property
    def edge(self) -> float:
        """See `AbstractPlaneMap`."""
        rigid = isinstance(self.rig.model.law, AbstractInstantaneousLaw)
        return float((float(self.rig.gap) - self.origin[0]) / self.cell[0]) if rigid else float("inf")

    def _chunk(self, state: Plane) -> Plane:
        """States of a chunk after `cycles`; what is missing to a full one is filled up with its last state."""
        full = np.concatenate([state, np.repeat(state[-1:], _LANES - len(state), axis=0)])
        u, v = jnp.asarray(full[:, 0]), jnp.asarray(full[:, 1])
        good = jnp.ones(_LANES, dtype=bool)
        for _ in range(self.cycles):
            u, v, arrived = _one_cycle(self.engine, self.lanes, u, v)
            good = good & arrived
        reached = np.where(np.asarray(good)[:, None], np.stack([np.asarray(u), np.asarray(v)], axis=-1), np.nan)
        return reached[: len(state)]


def check_plane(model: Model) -> None:
    """Raise `InputError` where an effect has a state of its own, so that states are no plane."""
    names = [effect.name for effect in model.rig.effects if effect.own_states]
    if names:
        raise InputError(
            f"manifolds are asked for, and {', '.join(names)} has a state of its own: expected a model whose state is u and u', since "
            "curves bound basins in a plane alone; leave the manifolds or the effect out"
        )


@compiled_for_long_runs
def _one_cycle(
    engine: AbstractEngine, lanes: Lanes, u: Float[Array, " lanes"], v: Float[Array, " lanes"]
) -> tuple[Float[Array, " lanes"], Float[Array, " lanes"], Bool[Array, " lanes"]]:
    """States one cycle later, and whether each was reached."""
    after, met = engine.advance(lanes, state_at(lanes.systems, u, v), 1, 1)
    return after.u, after.v, (met.result == SUCCESS) & jnp.isfinite(after.u) & jnp.isfinite(after.v)
