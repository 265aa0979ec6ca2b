"""Flight on a linear suspension under a sine: the exact motion, and a step that cannot pass the stop."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from vibrojax.excitation import Harmonic
from vibrojax.shapes import Scalars
from vibrojax.smooth import sine_cosine
from vibrojax.steps import cubic
from vibrojax.suspension import Linear
from vibrojax.system import System

_TURN = 2.0 * np.pi
_LOOK_AHEAD = 1.5
"""Of the step that the bound on acceleration allows: how far the bound on jerk is used instead."""
_LANDED = 1e-14
"""m; a touch is reached when its time is known so well that acceleration moves the hammer less than this in the rest."""
_SHORTEST = 1e-9
"""s"""
_WIDEST = 1.0
"""rad"""


class Flow(NamedTuple):
    """Numbers of the flight u'' + 2 zeta omega u' + omega^2 u = S sin theta + C cos theta, theta = Omega t, one a lane."""

    omega: Scalars
    decay: Scalars
    """zeta omega, 1/s."""
    ringing: Scalars
    """omega sqrt(1 - zeta^2), rad/s."""
    omega_exc: Scalars
    drive_sine: Scalars
    """S, m/s^2."""
    drive_cosine: Scalars
    """C, m/s^2."""
    steady_sine: Scalars
    """P of the steady motion P sin theta + Q cos theta, m."""
    steady_cosine: Scalars
    """Q, m."""
    gap: Scalars


class Flight(NamedTuple):
    """Where a lane flies: its free part, and its phase; u = a + P sin theta + Q cos theta."""

    a: Scalars
    """m"""
    b: Scalars
    """Rate of `a`, m/s."""
    theta: Scalars
    """Phase since the strobe, rad, in [0, 2 pi]."""
    sine: Scalars
    cosine: Scalars


class Point(NamedTuple):
    """What the eye sees."""

    u: Scalars
    v: Scalars
    acceleration: Scalars


def flow_of(system: System) -> Flow:
    """Numbers of the flight of a system on a `Linear` suspension, less than critically damped, under a `Harmonic` base."""
    suspension, base = system.suspension, system.base
    if not isinstance(suspension, Linear) or not isinstance(base, Harmonic):
        raise TypeError(f"{type(suspension).__name__} on {type(base).__name__}: exact flight needs Linear on Harmonic")
    omega = 2.0 * np.pi * jnp.asarray(suspension.natural_frequency_hz)
    decay = jnp.asarray(suspension.damping_ratio) * omega
    omega_exc = 2.0 * np.pi * jnp.asarray(base.frequency_hz)
    strength = base.base_amplitude * omega_exc**2
    s, c = strength * jnp.cos(base.base_phase), strength * jnp.sin(base.base_phase)
    near, turned = omega**2 - omega_exc**2, 2.0 * decay * omega_exc
    size = near**2 + turned**2
    return Flow(
        omega=omega,
        decay=decay,
        ringing=omega * jnp.sqrt(1.0 - suspension.damping_ratio**2),
        omega_exc=omega_exc,
        drive_sine=s,
        drive_cosine=c,
        steady_sine=(near * s + turned * c) / size,
        steady_cosine=(near * c - turned * s) / size,
        gap=jnp.asarray(system.gap),
    )


def take_off(flow: Flow, u: Scalars, v: Scalars, theta: Scalars) -> Flight:
    """The flight that passes through (u, v) at that phase."""
    s, c = sine_cosine(theta)
    a = u - flow.steady_sine * s - flow.steady_cosine * c
    return Flight(a, v - flow.omega_exc * (flow.steady_sine * c - flow.steady_cosine * s), theta, s, c)


def point(flow: Flow, flight: Flight) -> Point:
    """Displacement, velocity and acceleration in flight."""
    s, c = flight.sine, flight.cosine
    u = flight.a + flow.steady_sine * s + flow.steady_cosine * c
    v = flight.b + flow.omega_exc * (flow.steady_sine * c - flow.steady_cosine * s)
    drive = flow.drive_sine * s + flow.drive_cosine * c
    return Point(u, v, drive - 2.0 * flow.decay * v - flow.omega**2 * u)


def to_strobe(flow: Flow, theta: Scalars) -> Scalars:
    """Time to the next strobe, s."""
    return jnp.maximum(_TURN - theta, 0.0) / flow.omega_exc


def within_turn(angle: Scalars) -> Scalars:
    """The angle less whole turns, in [0, 2 pi], rad."""
    return jnp.clip(angle - _TURN * jnp.floor(angle * (1.0 / _TURN)), 0.0, _TURN)


def safe_step(flow: Flow, flight: Flight, here: Point) -> Scalars:
    """A step within which the stop is not reached, s.

    With R and R_p the amplitudes of the free and the steady part, |u''| <= omega^2 R + Omega^2 R_p =: A and |u'''| <= omega^3 R +
    Omega^3 R_p =: J from here on, because the free part only decays. Hence the distance d = gap - u stays above the parabola
    d - v s - A s^2 / 2, and for s < S above d - v s - (u'' + J S / 3) s^2 / 2. The step is the longer of what both allow; near a touch
    the distance left after it falls with the cube of the step. Where R + R_p < gap the stop is out of reach altogether. No step turns
    the excitation or the suspension by more than a radian, so that `highest` sees every turning point.
    """
    free = jnp.sqrt(flight.a**2 + ((flight.b + flow.decay * flight.a) / flow.ringing) ** 2)
    steady = jnp.sqrt(flow.steady_sine**2 + flow.steady_cosine**2)
    by_free, by_steady = flow.omega**2 * free, flow.omega_exc**2 * steady
    acceleration, jerk = by_free + by_steady, flow.omega * by_free + flow.omega_exc * by_steady
    d = jnp.maximum(flow.gap - here.u, 0.0)
    by_acceleration = _reached(d, here.v, acceleration)
    ahead = _LOOK_AHEAD * by_acceleration
    by_jerk = jnp.minimum(ahead, _reached(d, here.v, here.acceleration + jerk * ahead / 3.0))
    safe = jnp.maximum(jnp.maximum(by_acceleration, by_jerk), _SHORTEST)
    return jnp.minimum(jnp.where(free + steady < flow.gap, jnp.inf, safe), _WIDEST / jnp.maximum(flow.omega_exc, flow.ringing))


def fly(flow: Flow, flight: Flight, h: Scalars, theta: Scalars) -> Flight:
    """The flight h later, where the phase has come to `theta`; exact, for any h >= 0."""
    s, c = sine_cosine(within_turn(flow.ringing * h))
    fade, lean = jnp.exp(-flow.decay * h), s / flow.ringing
    a = fade * (c * flight.a + lean * (flight.b + flow.decay * flight.a))
    b = fade * (c * flight.b - lean * (flow.omega**2 * flight.a + flow.decay * flight.b))
    return Flight(a, b, theta, *sine_cosine(theta))


def at_stop(flow: Flow, here: Point) -> Bool[Array, "..."]:
    """Whether a flight has come to its touch but for what one Newton correction mends."""
    d = flow.gap - here.u
    return (here.v > 0) & ((jnp.abs(here.acceleration) * d**2 < 2.0 * _LANDED * here.v**2) | (d < _LANDED))


def highest(before: Point, after: Point, h: Scalars) -> Scalars:
    """Largest displacement in a step, m, from the quintic through both ends; of a turning point the time is that of the cubic velocity.

    For a vibration that turns by x in the step the quintic is off by at most x^6 / 46080 of its amplitude.
    """
    turns = (before.v > 0) & (after.v < 0)
    a0, a1 = h * before.acceleration, h * after.acceleration
    slope = jnp.where(turns, before.v - after.v, 1.0)
    sigma = jnp.where(turns, before.v / slope, 0.0)
    for _ in range(2):
        value, _ = cubic(sigma, before.v, a0, after.v, a1)
        sigma = jnp.clip(sigma + value / slope, 0.0, 1.0)
    top = _quintic(sigma, before, after, h)
    return jnp.where(turns, top, jnp.maximum(before.u, after.u))


def _reached(d: Scalars, v: Scalars, acceleration: Scalars) -> Scalars:
    """First time at which d - v s - acceleration s^2 / 2 is zero; infinite where it never is."""
    square = v**2 + 2.0 * acceleration * d
    root = jnp.sqrt(jnp.maximum(square, 0.0))
    towards = v >= 0
    fast = 2.0 * d / jnp.where(towards, jnp.maximum(v + root, 1e-300), 1.0)
    slow = jnp.where(acceleration > 0, (root - v) / jnp.where(acceleration > 0, acceleration, 1.0), jnp.inf)
    return jnp.where(square < 0, jnp.inf, jnp.where(towards, fast, slow))


def _quintic(s: Scalars, before: Point, after: Point, h: Scalars) -> Scalars:
    """Displacement at part s of a step, from displacement, velocity and acceleration at both ends."""
    c1, c2 = h * before.v, 0.5 * h * h * before.acceleration
    rest = after.u - before.u - c1 - c2
    slope = h * after.v - c1 - 2.0 * c2
    bend = h * h * after.acceleration - 2.0 * c2
    c3, c4, c5 = 10.0 * rest - 4.0 * slope + 0.5 * bend, 7.0 * slope - 15.0 * rest - bend, 6.0 * rest - 3.0 * slope + 0.5 * bend
    return before.u + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
