"""How fast the hammer comes to the stop and leaves it, read off the measured displacement on either side of each contact."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from identification.report.record_view import Impact, impacts
from identification.result import RecordFit
from vibrojax.contact.restitution import restitution
from vibrojax.effects import AbstractEffect
from vibrojax.model import Model

_SHOW_THE_HAMMER = ("relative_displacement", "hammer_displacement")
_LONGEST = 0.05
"""Of the stretch on either side, s: beyond, a support that is free shows its own vibration."""
_OF_PERIOD = 0.25
"""The same over the period of the suspension."""
_MARGIN = 0.25
"""Of the contact's duration, left out on either side, as the fitted motion may touch a little early or late."""
_FEWEST = 6
"""Samples that it takes to tell a speed and its error."""
_VAGUE = 0.1
"""Standard error from which a contact tells nothing of its restitution."""
_GRAZES = 0.5
"""Of the measured approach speed, above which the fitted motion meets the stop as the hammer did."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rebound:
    """One contact, between the last sample before it and the first one after it.

    Attributes:
        file: of the record.
        approach_speed: m/s.
        restitution: speed after over speed before.
        stderr: of the restitution, from the scatter about the two flights.
        fitted_speed, fitted: both of the fitted motion, since what spring and cart do during a contact is in measured and fitted alike;
            of a free hammer, whose windows may have followed the record, what the fitted law makes of the measured approach.
        by_law: whether the latter.
    """

    file: str
    approach_speed: float
    restitution: float
    stderr: float
    fitted_speed: float
    fitted: float
    by_law: bool = False


def rebounds(records: Sequence[RecordFit], model: Model) -> list[Rebound]:
    """Every contact that has flight enough before and after it to tell its restitution.

    What a record differs by from the fitted motion is, in flight, a free vibration of the suspension; two numbers describe it, and its
    velocity at the touch is added to the fitted one's. Of the model only flight and the instants of contact are used for what is measured.

    Args:
        records: beside their predictions.
        model: fitted.

    Returns:
        Them record by record, in order of time; none of a record without displacement or of one whose hammer is led.
    """
    values = model.values()
    flight = _Flight(omega=2.0 * np.pi * float(values.get("f_n", 0.0)), zeta=float(values.get("zeta", 0.0)))
    read = [(record.kind, one) for record in records if record.kind != "prescribed" for one in _of_record(record, flight)]
    found = [one for _, one in read]
    if found and {kind for kind, _ in read} == {"drop-test"} and _is_free(model):
        return _by_law(found, model)
    return [one for one in found if one.fitted_speed > _GRAZES * one.approach_speed and np.isfinite(one.fitted)]


def _is_free(model: Model) -> bool:
    """Whether nothing but the stop acts on the hammer during a contact, if the cart is at rest."""
    stops = [effect.is_fault or type(effect).stop is not AbstractEffect.stop for effect in model.effects]
    return "f_n" not in model.values() and all(stops)


def _by_law(read: list[Rebound], model: Model) -> list[Rebound]:
    """With what the contact law, and effects that change it, give a free hammer at the measured approach speeds."""
    law, gap = model.law, 0.0
    for effect in model.effects:
        law, gap = effect.stop(law, gap)
    found = np.asarray(restitution(law, model.mass, jnp.asarray([one.approach_speed for one in read])))
    told = [
        dataclasses.replace(one, fitted_speed=one.approach_speed, fitted=float(e), by_law=True) for one, e in zip(read, found, strict=True)
    ]
    return [one for one in told if np.isfinite(one.fitted)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Flight:
    """Free vibration of the suspension: omega in rad/s, 0 without a spring."""

    omega: float
    zeta: float

    @property
    def reach(self) -> float:
        """Stretch on either side of a contact, s."""
        return min(_LONGEST, _OF_PERIOD * 2.0 * np.pi / self.omega) if self.omega > 0 else _LONGEST

    def velocity(self, since: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"]) -> tuple[float, float] | None:
        """At time zero, m/s, of the free vibration through some samples, and its standard error; None of too few."""
        usable = np.isfinite(u)
        if usable.sum() < _FEWEST:
            return None
        t, u = since[usable], u[usable]
        rises = np.sin(self.omega * t) / self.omega if self.omega > 0 else t
        damping = self.zeta * self.omega  # too little to change the frequency
        columns = np.exp(-damping * t)[:, None] * np.stack([np.cos(self.omega * t) + damping * rises, rises], axis=1)
        inverse = np.linalg.pinv(columns)
        place_and_speed = inverse @ u
        scatter = u - columns @ place_and_speed
        variance = scatter @ scatter / (len(t) - len(place_and_speed))
        return float(place_and_speed[1]), float(np.sqrt(variance) * np.linalg.norm(inverse[1]))


def _of_record(record: RecordFit, flight: _Flight) -> list[Rebound]:
    """All contacts of a record that have flight on either side; none where no displacement was recorded."""
    channel = next((name for name in _SHOW_THE_HAMMER if name in record.measured), None)
    if channel is None:
        return []
    differs, found = record.measured[channel] - record.predicted[channel], impacts(record)
    ends = [0, *(impact.end for impact in found)]
    begins = [*(impact.first for impact in found[1:]), len(differs)]
    read = [_read(record, differs, flight, *one) for one in zip(found, ends, begins, strict=False)]
    return [one for one in read if one is not None and one.stderr < _VAGUE]


def _read(
    record: RecordFit, differs: Float[np.ndarray, " samples"], flight: _Flight, impact: Impact, end: int, begin: int
) -> Rebound | None:
    """One contact between the `end` of the one before and the `begin` of the next; None where flight is too short."""
    samples, margin = np.arange(len(differs)), 1 + int(_MARGIN * (impact.end - impact.first))
    touch, release = max(impact.first - 1, 0), min(impact.end, len(differs) - 1)  # in flight still, and again
    comes = (samples >= end + margin) & (samples <= touch - margin) & (record.time >= record.time[touch] - flight.reach)
    leaves = (samples >= release + margin) & (samples < begin - margin) & (record.time <= record.time[release] + flight.reach)
    found = []
    for at, part in ((touch, comes), (release, leaves)):
        part &= record.window == record.window[at]  # from one to the next the fitted motion jumps
        told = flight.velocity(record.time[part] - record.time[at], differs[part])
        if told is None:
            return None
        found.append((record.relative_velocity[at] + told[0], told[1]))
    (speed, error), (after, error_after) = found
    if not speed > 0.0:
        return None
    fitted_speed, fitted_after = record.relative_velocity[touch], record.relative_velocity[release]
    of_one_motion = record.window[touch] == record.window[release] and fitted_speed > 0.0
    return Rebound(
        file=record.file,
        approach_speed=float(speed),
        restitution=float(-after / speed),
        stderr=float(np.hypot(error_after, after / speed * error) / speed),
        fitted_speed=float(fitted_speed),
        fitted=float(-fitted_after / fitted_speed) if of_one_motion else np.nan,
    )
