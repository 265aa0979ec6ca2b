"""Coefficient of restitution of each contact, measured from the displacement in flight on either side of it."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from identification.result.result import Impact, RecordFit, impacts, merged
from vibrojax.contact import restitution
from vibrojax.model import Model

_SHOW_THE_HAMMER = ("relative_displacement", "hammer_displacement")
_FEWEST = 6
"""Fewest samples for a speed and its standard error."""
_TINY = np.finfo(float).tiny


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rebound:
    """Measured and fitted restitution of one contact, between the last sample before it and the first one after it; speeds in m/s.

    The standard error of the restitution comes from the scatter about the two flights. `fitted_speed` and `fitted` are those of the fitted
    motion, since spring and cart act alike on measured and fitted motion during a contact. Where the hammer is free, they are the measured
    speed and the law's restitution at it (`by_law`): the fitted motion need not meet the stop when the record does.
    """

    file: str
    approach_speed: float
    restitution: float
    stderr: float
    fitted_speed: float
    fitted: float
    by_law: bool = False


def rebounds(records: Sequence[RecordFit], model: Model) -> list[Rebound]:
    """Restitution of every contact with sufficient flight before and after it.

    In flight, the difference between record and fitted motion is a free vibration of the suspension, described by two numbers. Its velocity
    at the touch is added to the fitted one. A hammer without suspension, beside a cart at rest, needs no fitted motion. The measurement
    uses only flight and instants of contact of the model. Rebounds stand record by record, in order of time; records without displacement
    or with a prescribed motion have none.
    """
    values = model.values()
    flight = _Flight(omega=2.0 * np.pi * float(values.get("f_n", 0.0)), zeta=float(values.get("zeta", 0.0)))
    let_go = [record for record in records if record.kind != "prescribed" and _contacts(record)]
    if _is_free(model) and all(record.kind == "drop-test" for record in let_go):
        downhill = float(model.load.force(model.mass) / model.mass)
        return _by_law([one for record in let_go for one in _of_record(record, flight, downhill)], model)
    found = [one for record in let_go for one in _of_record(record, flight)]
    touching = [one for one in found if one.fitted_speed > 0.5 * one.approach_speed]  # else the fit misses the impact
    return [one for one in touching if np.isfinite(one.fitted)]


def _is_free(model: Model) -> bool:
    """Whether only the stop acts on the hammer during a contact, for a cart at rest, and no sensor fault affects its displacement."""
    return "f_n" not in model.values() and all(
        effect.channel not in _SHOW_THE_HAMMER if effect.is_fault else effect.does("stop") for effect in model.effects
    )


def _by_law(read: list[Rebound], model: Model) -> list[Rebound]:
    """Rebounds with the restitution of the contact law, with effects that change it, for a free hammer at the measured approach speeds."""
    found = np.asarray(restitution(model.stop(0.0)[0], model.mass, jnp.asarray([one.approach_speed for one in read])))
    return [
        dataclasses.replace(one, fitted_speed=one.approach_speed, fitted=float(e), by_law=True)
        for one, e in zip(read, found, strict=True)
        if np.isfinite(e)
    ]


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Flight:
    """Free vibration of the suspension: omega in rad/s, 0 without a spring."""

    omega: float
    zeta: float

    @property
    def reach(self) -> float:
        """Length of flight used on either side of a contact, s."""
        longest = 0.05  # s: beyond it, a free support shows its own vibration
        return min(longest, 0.5 * np.pi / self.omega) if self.omega > 0 else longest  # a quarter of the suspension's period

    def velocity(self, since: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"]) -> tuple[float, float] | None:
        """Velocity at time zero, m/s, of the free vibration fitted to some samples, with its standard error; None for too few samples.

        The error allows for autocorrelated residuals, as on a support that differs from the model.
        """
        usable = np.isfinite(u)
        if usable.sum() < _FEWEST:
            return None
        t, u = since[usable], u[usable]
        columns = self._columns(t)
        inverse = np.linalg.pinv(columns)
        place_and_speed = inverse @ u
        scatter = u - columns @ place_and_speed
        variance = scatter @ scatter / (len(t) - len(place_and_speed)) / _independent(scatter)
        return float(place_and_speed[1]), float(np.sqrt(variance) * np.linalg.norm(inverse[1]))

    def scatter(self, since: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
        """Residual of the free vibration fitted to some samples, m."""
        columns = self._columns(since)
        return u - columns @ (np.linalg.pinv(columns) @ u)

    def _columns(self, t: Float[np.ndarray, " samples"]) -> Float[np.ndarray, "samples 2"]:
        """Free vibrations with unit displacement and with unit velocity at time zero."""
        rises = np.sin(self.omega * t) / self.omega if self.omega > 0 else t
        damping = self.zeta * self.omega  # too small to change the frequency
        return np.exp(-damping * t)[:, None] * np.stack([np.cos(self.omega * t) + damping * rises, rises], axis=1)


def _independent(scatter: Float[np.ndarray, " samples"]) -> float:
    """Effective share of independent samples, from the lag-1 autocorrelation of the residuals."""
    alike = min(max(float(scatter[1:] @ scatter[:-1] / max(scatter @ scatter, _TINY)), 0.0), 0.9)  # the largest correlation used
    return (1.0 - alike) / (1.0 + alike)


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Course:
    """Measured displacement relative to a known motion, m; velocity of that, m/s, and number of the window in which it is continuous."""

    over: Float[np.ndarray, " samples"]
    velocity: Float[np.ndarray, " samples"]
    piece: np.ndarray


def _course(record: RecordFit, downhill: float | None) -> _Course | None:
    """Displacement relative to the fitted motion, or to a fall at a constant acceleration, m/s^2; None where it was not recorded."""
    channel = next((name for name in _SHOW_THE_HAMMER if name in record.measured), None)
    if channel is None:
        return None
    u = record.measured[channel]
    if downhill is None:
        return _Course(over=u - record.predicted[channel], velocity=record.relative_velocity, piece=record.window)
    since = record.time - record.time[0]
    return _Course(over=u - 0.5 * downhill * since**2, velocity=downhill * since, piece=np.zeros_like(record.window))


def _of_record(record: RecordFit, flight: _Flight, downhill: float | None = None) -> list[Rebound]:
    """Rebounds of a record from all contacts with flight on either side, beside the fitted motion or a free fall `downhill`, m/s^2."""
    course = _course(record, downhill)
    if course is None:
        return []
    found = _contacts(record)
    ends = [0, *(impact.end for impact in found)]
    begins = [*(impact.first for impact in found[1:]), len(course.over)]
    read = [_read(record, course, flight, *one) for one in zip(found, ends, begins, strict=False)]
    return [one for one in read if one is not None and one.stderr < 0.1]  # a vaguer one says nothing


def _contacts(record: RecordFit) -> list[Impact]:
    """Contacts in order of time; those without a sample in them, as with a rigid stop, where the fitted velocity reverses abruptly."""
    v = record.relative_velocity
    turn = -np.diff(v) * (np.diff(record.window) == 0)
    beside = np.maximum(np.pad(turn, (1, 0))[:-1], np.pad(turn, (0, 1))[1:])
    sudden = (v[:-1] > 0.0) & (v[1:] < 0.0) & (turn > 10.0 * beside)  # steps of the velocity beside a rebound are smaller
    return merged([*impacts(record), *(Impact(first=int(at), end=int(at)) for at in np.flatnonzero(sudden) + 1)])


def _read(record: RecordFit, course: _Course, flight: _Flight, impact: Impact, end: int, begin: int) -> Rebound | None:
    """Rebound of one contact between the `end` of the previous one and the `begin` of the next; None where flight is too short."""
    samples, margin = np.arange(len(record.time)), 1 + int(0.25 * (impact.end - impact.first))  # the fitted motion may touch early or late
    touch, release = max(impact.first - 1, 0), min(impact.end, len(samples) - 1)  # last sample before and first after the contact
    comes = (samples >= end + margin) & (samples <= touch - margin) & (record.time >= record.time[touch] - flight.reach)
    leaves = (samples >= release + margin) & (samples < begin - margin) & (record.time <= record.time[release] + flight.reach)
    comes &= course.piece == course.piece[touch]
    leaves &= course.piece == course.piece[release]
    if impact.first == impact.end:
        comes, leaves = _beside_the_turn(record, course, flight, impact.first, comes, leaves)
    found = []
    for at, part in ((touch, comes), (release, leaves)):
        estimate = flight.velocity(record.time[part] - record.time[at], course.over[part])
        if estimate is None:
            return None
        found.append((course.velocity[at] + estimate[0], estimate[1]))
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


def _beside_the_turn(
    record: RecordFit, course: _Course, flight: _Flight, fitted: int, comes: np.ndarray, leaves: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Flights before and after a rebound from a rigid stop, separated at another instant than the fitted one if that fits clearly better.

    The samples between the two instants are left out. Where the fitted motion rebounds too early or late, the record between the two is a
    flight of its own; and a hammer that is not rigid may vibrate for a while after a rebound.
    """
    samples, place = np.arange(len(record.time)), np.flatnonzero((comes | leaves) & np.isfinite(course.over))
    since, over, step = record.time[place] - record.time[fitted], course.over[place], 1 + len(place) // 100  # about so many instants

    def scatter(turn: int) -> np.ndarray:
        parts = np.split(np.arange(len(place)), np.searchsorted(place, sorted({turn, fitted})))
        return np.concatenate([flight.scatter(since[part], over[part]) for part in parts])

    near = [int(one) for one in place[_FEWEST + step : len(place) - _FEWEST - step + 1 : step]]
    left = {turn: scatter(turn) for turn in [fitted, *near]}
    turn = min(left, key=lambda one: left[one] @ left[one])
    drop = len(place) * _independent(left[turn]) * np.log((left[fitted] @ left[fitted] + _TINY) / (left[turn] @ left[turn] + _TINY))
    if turn in (near[:1] + near[-1:]) or drop < 16.0:  # chi-square: above the largest drop over all instants due to noise
        turn = fitted
    return comes & (samples < turn - step), leaves & (samples >= turn + step)
