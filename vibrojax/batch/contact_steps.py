"""Contact with a compliant stop: graded steps from touch to release, and the peak of the force on the way."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from vibrojax.batch.linear_flow import Flow, to_strobe
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.shapes import Number, Scalars
from vibrojax.smooth import small_rotation
from vibrojax.steps import cubic_top

_PHASE = 0.15
"""rad; a contact step turns the excitation no further."""
_LAST = 1.5
"""The step to the release may be so many times longer than the grading has it, in the square root of the time left."""
_MISS = 1e-3
"""A release is accepted when the time left is below this part of the shortest step."""
_STAGES = np.zeros((7, 7))
_STAGES[1, :1] = 1 / 6
_STAGES[2, :2] = 2 / 27, 4 / 27
_STAGES[3, :3] = 183 / 1372, -162 / 343, 1053 / 1372
_STAGES[4, :4] = 68 / 297, -4 / 11, 42 / 143, 1960 / 3861
_STAGES[5, :5] = 597 / 22528, 81 / 352, 63099 / 585728, 58653 / 366080, 4617 / 20480
_STAGES[6, :6] = 174197 / 959244, -30942 / 79937, 8152137 / 19744439, 666106 / 1039181, -29421 / 29068, 482048 / 414219
_NODES = _STAGES.sum(axis=1)
_WEIGHTS = np.array([587 / 8064, 0.0, 4440339 / 15491840, 24353 / 124800, 387 / 44800, 2152 / 5985, 7267 / 94080])
"""Bogacki and Shampine's formula of order five. The last stage lies at the end of the step."""


class Contact(NamedTuple):
    """A lane in contact."""

    u: Scalars
    v: Scalars
    theta: Scalars
    drive: Scalars
    """-y'' at this phase, m/s^2."""
    drive_quarter: Scalars
    """-y'' a quarter of a turn later, m/s^2."""
    since_touch: Scalars
    """s"""
    force: Scalars
    """At the start of the last step, N."""
    slope: Scalars
    """Its rate, N/s."""
    h: Scalars
    """Length of the last step, s; 0 at the touch."""
    peak: Scalars
    """Largest force so far, N."""
    u_max: Scalars
    """Largest displacement so far, m."""


class Touching(NamedTuple):
    """What of a contact stays as it was at the touch."""

    law: AbstractCompliantLaw
    mass: Scalars
    approach_speed: Scalars
    grade: Scalars
    """Step in the square root of the time since the touch, or to the release, sqrt(s)."""


def touching(law: AbstractCompliantLaw, mass: Scalars, approach_speed: Scalars, steps: Number) -> Touching:
    """What the steps of a contact need to know of its touch; `steps` for an impact of average duration."""
    half = 0.5 * law.contact_time(mass, approach_speed)
    return Touching(law, mass, approach_speed, jnp.sqrt(half) * 2.0 / steps)


def contact_step(
    flow: Flow, touch: Touching, at: Contact, moves: Bool[Array, "..."], steps: Number
) -> tuple[Contact, Bool[Array, "..."], Bool[Array, "..."]]:
    """One Runge-Kutta step of order five of the lanes that move: then whether the hammer has left the stop, or else stands at a strobe.

    The force of a law delta^n is not smooth at touch and release: steps grow from the touch, and shrink towards the release, so that they
    are equal in the square root of the time since or left, where a power n = 1.5 is smooth. In between they are equal parts of the
    contact's own period, 2 pi sqrt(m delta / F) / `steps`. The last step ends within a thousandth of its length of the release; one Newton
    correction does the rest.

    Source: P. Bogacki, L. F. Shampine, An efficient Runge-Kutta (4,5) pair, Comput. Math. Appl. 32 (1996) 15-28, its formula of order five,
    whose error constant is a twentieth of that of Dormand and Prince for one more stage; the grading is ours.
    """
    force, slope, acceleration = _force(flow, touch, at)
    h, lands = _length(touch, at, at.u - flow.gap, force, acceleration, steps)
    h = jnp.minimum(h, _PHASE / flow.omega_exc)
    remaining = to_strobe(flow, at.theta)
    strobes = remaining <= h
    h = jnp.where(moves, jnp.minimum(remaining, h), 0.0)  # a step of length 0 changes nothing

    u, v, drive, drive_quarter, last = _runge_kutta(flow, touch, at, h, acceleration)
    left, correction = _released(touch, u - flow.gap, v, last, lands & ~strobes)
    later = h + correction
    after = Contact(
        u=jnp.where(left, flow.gap, u),
        v=v + last * correction,
        theta=jnp.where(strobes & moves, 0.0, at.theta + flow.omega_exc * later),
        drive=jnp.where(strobes, flow.drive_cosine, drive),
        drive_quarter=jnp.where(strobes, flow.drive_sine, drive_quarter),
        since_touch=at.since_touch + later,
        force=force,
        slope=slope,
        h=h,
        peak=jnp.maximum(at.peak, _peak(at, force, slope)),
        u_max=jnp.maximum(at.u_max, cubic_top(at.u, h * at.v, u, h * v)),
    )
    return after, left, strobes & ~left


def peak_so_far(flow: Flow, touch: Touching, at: Contact) -> Scalars:
    """Largest force up to here, N; `Contact.peak` is known up to the start of the last step only."""
    force, slope, _ = _force(flow, touch, at)
    return jnp.maximum(at.peak, _peak(at, force, slope))


def _push(flow: Flow, touch: Touching, u: Scalars, v: Scalars) -> Scalars:
    return touch.law.force(jnp.maximum(u - flow.gap, 0.0), v, touch.approach_speed)


def _force(flow: Flow, touch: Touching, at: Contact) -> tuple[Scalars, Scalars, Scalars]:
    """Force, N, its rate, N/s, and u'', m/s^2."""
    still = jnp.zeros_like(at.v)
    force, by_depth = jax.jvp(lambda u, v: _push(flow, touch, u, v), (at.u, at.v), (at.v, still))
    acceleration = _acceleration(flow, touch, at.u, at.v, at.drive, force)
    _, by_rate = jax.jvp(lambda u, v: _push(flow, touch, u, v), (at.u, at.v), (still, acceleration))
    return force, by_depth + by_rate, acceleration


def _acceleration(flow: Flow, touch: Touching, u: Scalars, v: Scalars, drive: Scalars, force: Scalars) -> Scalars:
    return (touch.mass * (drive - 2.0 * flow.decay * v - flow.omega**2 * u) - force) / touch.mass


def _runge_kutta(flow: Flow, touch: Touching, at: Contact, h: Scalars, a1: Scalars):
    """u, v, drive, drive a quarter turn later and u'' (at the last stage) h later.

    With u' = v put in, stages depend on earlier accelerations alone: u + c h v + h^2 (A A a) and v + h (A a). XLA would otherwise compute
    the velocities of all earlier stages again in each.
    """
    accelerations = [a1]

    def combined(weights: np.ndarray) -> Scalars:
        return sum((float(weight) * a for weight, a in zip(weights, accelerations, strict=False) if weight), jnp.zeros_like(h))

    def moved(part: float, row: np.ndarray) -> tuple[Scalars, Scalars]:
        return at.u + h * (part * at.v + h * combined(row @ _STAGES)), at.v + h * combined(row)

    for part, row in zip(_NODES[1:].tolist(), _STAGES[1:], strict=True):
        s, c = small_rotation(part * flow.omega_exc * h)
        u, v = moved(part, row)
        accelerations.append(_acceleration(flow, touch, u, v, at.drive * c + at.drive_quarter * s, _push(flow, touch, u, v)))
    s, c = small_rotation(flow.omega_exc * h)
    return *moved(1.0, _WEIGHTS), at.drive * c + at.drive_quarter * s, at.drive_quarter * c - at.drive * s, accelerations[-1]


def _length(touch: Touching, at: Contact, delta: Scalars, force: Scalars, acceleration: Scalars, steps: Number):
    """Graded length of the next step, s, and whether it is meant to end at the release."""
    grade = touch.grade
    from_touch = grade**2 + 2.0 * grade * jnp.sqrt(at.since_touch)
    pushed = (delta > 0) & (force > 0)
    own = jnp.sqrt(jnp.where(pushed, touch.mass * delta / jnp.where(pushed, force, 1.0), jnp.inf))
    h = jnp.minimum(from_touch, 2.0 * np.pi / steps * own)

    square = at.v**2 - 2.0 * acceleration * delta
    leaves = (at.v < 0) & (square > 0) & (delta > 0)
    speed = jnp.where(leaves, jnp.sqrt(jnp.maximum(square, 0.0)) - at.v, 1.0)
    left = jnp.where(leaves, 2.0 * delta / speed, jnp.inf)
    root = jnp.sqrt(left)
    lands = leaves & (root <= _LAST * grade)
    to_release = jnp.where(lands, left, 2.0 * grade * root - grade**2)
    return jnp.where(lands, left, jnp.minimum(h, jnp.where(leaves, to_release, jnp.inf))), lands


def _released(touch: Touching, delta: Scalars, v: Scalars, acceleration: Scalars, lands: Bool[Array, "..."]):
    """Whether the hammer has left the stop, and the Newton correction to the time at which it did, s."""
    outward = v < 0
    late = -delta / jnp.where(outward, v, -1.0)
    left = outward & ((delta <= 0) | (lands & (late < _MISS * touch.grade**2)))
    return left, jnp.where(left, late, 0.0)


def _peak(at: Contact, force: Scalars, slope: Scalars) -> Scalars:
    """Largest force within the step that ends here, N."""
    return cubic_top(at.force, at.h * at.slope, force, at.h * slope)
