"""The fast path: exact linear flight from touch to touch, graded Runge-Kutta in contact."""

from functools import partial
from typing import ClassVar, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.batch.base import AbstractEngine, Count, Cycles, Lanes, LaneState
from vibrojax.batch.contact_steps import Contact, contact_step, peak_so_far, touching
from vibrojax.batch.linear_flow import Flight, Flow, at_stop, flow_of, fly, highest, point, safe_step, take_off, to_strobe, within_turn
from vibrojax.compiling import as_one_function
from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw, AbstractInstantaneousLaw
from vibrojax.contact.base import SLOWEST_APPROACH
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate.base import CHATTER, NOT_FINITE, STEP_LIMIT, SUCCESS
from vibrojax.integrate.landing import SLOWEST_TOUCH
from vibrojax.suspension import Linear

_CHATTER = 1e-10
"""m; a rigid stop from which the hammer would rebound no further than this while it is pressed on holds it."""

_STROBES = 3
"""That one flight may pass before the lane waits for the others."""

_Lanes = Float[Array, " lanes"]


class _Sections(NamedTuple):
    """Strobes so far."""

    cycle: Int[Array, " lanes"]
    """Cycle in which each lane is; 0 is the first recorded one, those before are negative."""
    u: Float[Array, "rows lanes"]
    v: Float[Array, "rows lanes"]


class _Impacts(NamedTuple):
    """What each impact adds."""

    count: Int[Array, "rows lanes"]
    peak: Float[Array, "rows lanes"]
    speed: Float[Array, "rows lanes"]


class _Carry(NamedTuple):
    """All lanes, each at a touch, at a strobe, or at the end of its cycles."""

    flight: Flight
    v: _Lanes
    approach_speed: _Lanes
    in_contact: Bool[Array, " lanes"]
    since_touch: _Lanes
    sections: _Sections
    impacts: _Impacts
    u_max: _Lanes
    result: Int[Array, " lanes"]


class ExactFlight(AbstractEngine):
    """Lanes fly to their next touch, all of them; then those that touched go through contact, all of them; and again.

    Flight is the exact solution in steps that cannot pass the stop (`linear_flow.safe_step`), hence without error but for rounding;
    contact is Runge-Kutta of order five in graded steps (`contact_steps.contact_step`), or the jump of a rigid stop. Both loops end when
    the last lane has, so that neither computes what the other needs. No library sine and no `pow` is called within a step.

    For a `Linear` suspension, less than critically damped, under a pure sine, without effects and without an applied force; any contact
    law. The error falls with about the fifth power of `contact_steps`; with the default 20 a section point of a periodic orbit is off by
    some 1e-6 of the base amplitude, and the peak force by 1e-4 of itself (`tests/batch/test_agreement.py`).

    Arguments:
        contact_steps: steps in an impact of average duration.
        most_steps: in one flight and in one contact; a lane that needs more ends with `STEP_LIMIT`.

    Source: exact flight with root finding is common for impact oscillators (S. W. Shaw, P. J. Holmes, A periodically forced piecewise
    linear oscillator, J. Sound Vib. 90 (1983) 129-155); the safe step and the graded contact steps are ours.
    """

    name: ClassVar[str] = "exact-flight"
    in_kernel: ClassVar[bool] = True

    contact_steps: float = eqx.field(static=True, default=20.0)
    most_steps: int = eqx.field(static=True, default=20_000)

    def unfit(self, lanes: Lanes) -> str | None:
        system = lanes.systems
        if system.effects:
            return f"effects ({', '.join(effect.name for effect in system.effects)})"
        if not isinstance(system.suspension, Linear):
            return f"suspension {system.suspension.name!r}, which is not linear"
        if np.any(np.asarray(system.load) != 0.0):
            return "a constant load on the hammer"
        if not isinstance(system.base, Harmonic) or not isinstance(system.applied, Unforced):
            return "an excitation other than a pure sine of the cart"
        if not np.all((np.asarray(system.suspension.damping_ratio) < 1.0) & (np.asarray(system.suspension.natural_frequency_hz) > 0.0)):
            return "a suspension that does not oscillate (zeta >= 1, or f_n = 0)"
        return None

    def advance(self, lanes: Lanes, state: LaneState, cycles: Count, recorded: int) -> tuple[LaneState, Cycles]:
        system, flow = lanes.systems, flow_of(lanes.systems)
        law = system.law
        if not isinstance(law, AbstractCompliantLaw | AbstractInstantaneousLaw):
            raise TypeError(f"{type(law).__name__} is neither compliant nor rigid: expected a law of one of the two kinds")

        def runs(carry: _Carry) -> Bool[Array, " lanes"]:
            return (carry.sections.cycle < recorded) & (carry.result == SUCCESS)

        def unfinished(carry: _Carry):
            return _any(runs(carry))

        def onward(flow: Flow, law: AbstractContactLaw, mass: _Lanes, carry: _Carry) -> _Carry:
            carry = self._fly_to_touch(flow, carry, runs(carry) & ~carry.in_contact, recorded)
            entering = runs(carry) & carry.in_contact
            if isinstance(law, AbstractCompliantLaw):
                return self._through_contact(flow, law, mass, carry, entering)
            return _rebound(flow, cast(AbstractInstantaneousLaw, law), carry, entering)

        @as_one_function
        def to_the_end(flow: Flow, law: AbstractContactLaw, mass: _Lanes, carry: _Carry) -> _Carry:
            return lax.while_loop(unfinished, partial(onward, flow, law, mass), carry)

        return _finish(state, to_the_end(flow, law, jnp.asarray(system.mass), _start(flow, state, cycles, recorded)), cycles, recorded)

    def _fly_to_touch(self, flow: Flow, carry: _Carry, flies: Bool[Array, " lanes"], recorded: int) -> _Carry:
        """The lanes that fly, to their next touch, or past a few strobes and then back to the last of them."""
        room = jnp.minimum(_STROBES, recorded - carry.sections.cycle).astype(carry.v.dtype)

        def unfinished(loop):
            return _any(loop[-1]) & (loop[-2] < self.most_steps)

        def onward(loop):
            flight, here, turns, u_max, count, moves = loop
            h = jnp.where(moves, safe_step(flow, flight, here), 0.0)  # a step of length 0 changes nothing
            theta = flight.theta + flow.omega_exc * h
            turns, theta = turns + jnp.floor(theta * (0.5 / np.pi)), within_turn(theta)
            flight = fly(flow, flight, h, theta)
            there = point(flow, flight)
            u_max = jnp.maximum(u_max, highest(here, there, h))
            return flight, there, turns, u_max, count + 1, moves & ~at_stop(flow, there) & (turns < room)

        start = (carry.flight, point(flow, carry.flight), jnp.zeros_like(carry.v), carry.u_max, jnp.asarray(0), flies)
        flight, here, turns, u_max, _, moves = lax.while_loop(unfinished, onward, start)
        sections, strobe = _passed(flow, carry, flies & ~moves, jnp.minimum(turns, room).astype(int))
        beyond = flies & (turns >= room)
        touches = flies & ~moves & ~beyond
        later = jnp.where(touches, (flow.gap - here.u) / jnp.where(touches, here.v, 1.0), 0.0)
        speed = here.v + here.acceleration * later
        flight = flight._replace(theta=within_turn(flight.theta + flow.omega_exc * later))
        return carry._replace(
            flight=_where(flies, _where(beyond, strobe, flight), carry.flight),
            v=jnp.where(touches, speed, carry.v),
            approach_speed=jnp.where(touches, speed, carry.approach_speed),
            in_contact=carry.in_contact | touches,
            sections=sections,
            u_max=jnp.where(sections.cycle >= 0, u_max, carry.u_max),
            result=jnp.where(moves, STEP_LIMIT, carry.result),
        )

    def _through_contact(
        self, flow: Flow, law: AbstractCompliantLaw, mass: _Lanes, carry: _Carry, entering: Bool[Array, " lanes"]
    ) -> _Carry:
        """The lanes in contact, to their releases or their next strobe."""
        afresh = carry.since_touch == 0
        speed = jnp.where(entering, jnp.maximum(carry.approach_speed, SLOWEST_TOUCH), 1.0)
        touch = touching(law, mass, speed, self.contact_steps)

        def unfinished(loop):
            return _any(loop[-1]) & (loop[-2] < self.most_steps)

        def onward(loop):
            at, left, strobed, count, moves = loop
            at, leaves, strobes = contact_step(flow, touch, at, moves, self.contact_steps)
            left, strobed = left | (moves & leaves), strobed | (moves & strobes)
            return at, left, strobed, count + 1, moves & ~leaves & ~strobes

        nobody = jnp.zeros_like(entering)
        start = (_enter(flow, carry), nobody, nobody, jnp.asarray(0), entering)
        contact, left, strobed, _, moves = lax.while_loop(unfinished, onward, start)
        peak = jnp.where(entering, peak_so_far(flow, touch, contact), 0.0)
        inside = carry.in_contact & ~left
        return carry._replace(
            flight=_where(entering, take_off(flow, contact.u, contact.v, contact.theta), carry.flight),
            v=jnp.where(entering, contact.v, carry.v),
            in_contact=inside,
            since_touch=jnp.where(entering, jnp.where(inside, contact.since_touch, 0.0), carry.since_touch),
            sections=_with_strobe(carry.sections, strobed, contact.u, contact.v),
            impacts=_with_impact(carry.impacts, carry.sections.cycle, entering & afresh, entering, carry.approach_speed, peak),
            u_max=jnp.where(entering & (carry.sections.cycle >= 0), contact.u_max, carry.u_max),
            result=jnp.where(moves, STEP_LIMIT, carry.result),
        )


def _start(flow: Flow, state: LaneState, cycles: Count, recorded: int) -> _Carry:
    rows = 1 << (recorded - 1).bit_length()  # shapes in a GPU kernel are powers of two
    nothing = jnp.zeros((rows, state.u.shape[0]), state.u.dtype)
    first = jnp.broadcast_to(jnp.asarray(recorded - cycles), state.u.shape)
    finite = jnp.isfinite(state.u) & jnp.isfinite(state.v)
    return _Carry(
        flight=take_off(flow, state.u, state.v, jnp.zeros_like(state.u)),
        v=state.v,
        approach_speed=state.approach_speed,
        in_contact=state.in_contact,
        since_touch=state.since_touch,
        sections=_Sections(first, nothing, nothing),
        impacts=_Impacts(jnp.zeros(nothing.shape, int), nothing, nothing),
        u_max=jnp.full_like(state.u, -jnp.inf),
        result=jnp.where(finite, SUCCESS, NOT_FINITE),
    )


def _passed(flow: Flow, carry: _Carry, flown: Bool[Array, " lanes"], turns: Int[Array, " lanes"]) -> tuple[_Sections, Flight]:
    """The strobes that a flight has passed, from where it took off; and the flight at the last strobe that there is room for."""
    sections, last, theta = carry.sections, carry.flight, jnp.zeros_like(carry.v)
    for index in range(_STROBES):
        h = to_strobe(flow, carry.flight.theta) + index * 2.0 * np.pi / flow.omega_exc
        strobe = fly(flow, carry.flight, h, theta)
        here, there = flown & (turns > index), point(flow, strobe)
        sections, last = _with_strobe(sections, here, there.u, there.v), _where(here, strobe, last)
    return sections, last


def _enter(flow: Flow, carry: _Carry) -> Contact:
    """All lanes as if in contact: at the touch, or where the last cycles ended inside a contact."""
    flight, inside = carry.flight, carry.since_touch > 0
    here = point(flow, flight)
    nothing = jnp.zeros_like(carry.v)
    rotated = take_off(flow, here.u, here.v, flight.theta)
    return Contact(
        u=jnp.where(inside, here.u, flow.gap),
        v=jnp.where(inside, here.v, carry.v),
        theta=flight.theta,
        drive=flow.drive_sine * rotated.sine + flow.drive_cosine * rotated.cosine,
        drive_quarter=flow.drive_sine * rotated.cosine - flow.drive_cosine * rotated.sine,
        since_touch=carry.since_touch,
        force=nothing,
        slope=nothing,
        h=nothing,
        peak=nothing,
        u_max=carry.u_max,
    )


def _rebound(flow: Flow, law: AbstractInstantaneousLaw, carry: _Carry, touched: Bool[Array, " lanes"]) -> _Carry:
    """The jump at a rigid stop; a lane that is pressed on and would not get away again is stuck."""
    away = law.rebound_speed(jnp.maximum(carry.approach_speed, SLOWEST_APPROACH))
    flight = take_off(flow, flow.gap, -away, carry.flight.theta)
    pressing = point(flow, flight).acceleration
    stuck = touched & (pressing > 0) & (away**2 < 2.0 * pressing * _CHATTER)
    nothing = jnp.zeros_like(carry.v)
    return carry._replace(
        flight=_where(touched, flight, carry.flight),
        v=jnp.where(touched, -away, carry.v),
        in_contact=carry.in_contact & ~touched,
        impacts=_with_impact(carry.impacts, carry.sections.cycle, touched, touched, carry.approach_speed, nothing),
        result=jnp.where(stuck, CHATTER, carry.result),
    )


def _with_strobe(sections: _Sections, strobes: Bool[Array, " lanes"], u: _Lanes, v: _Lanes) -> _Sections:
    """Those lanes stand at their next strobe, at (u, v)."""
    row = (jnp.arange(sections.u.shape[0])[:, None] == sections.cycle[None, :]) & strobes[None, :]
    u, v = jnp.where(row, u[None, :], sections.u), jnp.where(row, v[None, :], sections.v)
    return _Sections(sections.cycle + strobes.astype(int), u, v)


def _with_impact(
    impacts: _Impacts,
    cycle: Int[Array, " lanes"],
    begins: Bool[Array, " lanes"],
    lasts: Bool[Array, " lanes"],
    speed: _Lanes,
    peak: _Lanes,
) -> _Impacts:
    """All impacts, with those that begin in this cycle, or last in it."""
    row = jnp.arange(impacts.count.shape[0])[:, None] == cycle[None, :]
    return _Impacts(
        count=impacts.count + (row & begins[None, :]).astype(int),
        peak=jnp.where(row & lasts[None, :], jnp.maximum(impacts.peak, peak[None, :]), impacts.peak),
        speed=jnp.where(row & begins[None, :], jnp.maximum(impacts.speed, speed[None, :]), impacts.speed),
    )


def _finish(state: LaneState, end: _Carry, cycles: Count, recorded: int) -> tuple[LaneState, Cycles]:
    sections, impacts = end.sections, end.impacts
    u, v = _row(sections.u, recorded - 1), _row(sections.v, recorded - 1)
    finite = jnp.isfinite(u) & jnp.isfinite(v)
    result = jnp.where(finite, end.result, NOT_FINITE)
    after = LaneState(
        u, v, end.in_contact, end.approach_speed, end.since_touch, state.cycle + sections.cycle + (cycles - recorded), state.own
    )
    return after, Cycles(sections.u, sections.v, impacts.count, impacts.peak, impacts.speed, end.u_max, result)


def _where(condition: Bool[Array, " lanes"], yes, no):
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _any(condition: Bool[Array, " lanes"]) -> Bool[Array, ""]:
    """`jnp.any`, which Pallas does not lower."""
    return jnp.max(condition.astype(jnp.int32)) > 0


def _row(rows: Float[Array, "rows lanes"], number: int) -> _Lanes:
    """`rows[number]`, which Pallas does not lower."""
    there = jnp.arange(rows.shape[0])[:, None] == number
    return jnp.sum(jnp.where(there, rows, 0.0), axis=0)
