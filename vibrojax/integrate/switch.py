"""The switch model: flight and contact as two smooth systems, and a rule in the narrow band between them."""

from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.contact import AbstractCompliantLaw, AbstractInstantaneousLaw
from vibrojax.contact.base import SLOWEST_APPROACH
from vibrojax.integrate.base import CHATTER, NOT_FINITE, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory, without_effects
from vibrojax.integrate.landing import crossing, landing_correction
from vibrojax.system import System

_Scalar = Float[Array, ""]
_TURN = 1e-9
"""m/s; a turning point is landed on to within this."""
_GROWTH, _SHRINKAGE, _SAFETY = 5.0, 0.2, 0.9


class _Carry(NamedTuple):
    """State between two trial steps."""

    t: _Scalar
    u: _Scalar
    v: _Scalar
    approach_speed: _Scalar
    in_contact: Bool[Array, ""]
    h_free: _Scalar
    """Step that the error control proposes."""
    h_limit: _Scalar
    """Step that ends on the hyper-surface, or on a turning point; infinite where neither is known to be near."""
    sample: Int[Array, ""]
    steps: Int[Array, ""]
    result: Int[Array, ""]


class _Samples(NamedTuple):
    """What has been reached so far."""

    u: Float[Array, " time"]
    v: Float[Array, " time"]
    approach_speed: Float[Array, " time"]
    in_contact: Bool[Array, " time"]


class Switch(AbstractIntegrator):
    """Reference integrator of the discontinuous right-hand side: order eight, restarted at each passage between flight and contact.

    The state space is parted by the hyper-surface h(u) = u - gap = 0 into two sub-spaces, flight (h < 0) and contact (h > 0), each with
    its own smooth right-hand side. A step that leaves its sub-space is shortened until it ends in the band |h| <= eta. There the normal
    components of both vector fields decide; with n = dh/du both are the relative velocity, so that there is no sliding: v > 0 passes to
    contact, v < 0 to flight. A rigid stop reflects the velocity in the band instead. Turning points in flight are landed on too, so that a
    graze cannot hide inside a step. Where clipping makes a law's force vanish before the hammer leaves, the step control resolves the kink.

    Steps are chosen to keep the error of each below `rtol` and `atol`; forward-mode derivatives include the jump at each passage.
    Differentiable but at a grazing touch. Reverse mode is not supported.

    Arguments:
        rtol: relative error of a step.
        atol: absolute error of a step, in m and m/s.
        band: eta, m. A rigid stop from which the hammer would rebound no further than this gives the result `CHATTER`.
        max_steps: loops stop after this many trial steps, with `STEP_LIMIT`.

    Source: R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Stick-slip vibrations induced by alternate friction models,
    Nonlinear Dyn. 16 (1998) 41-54, section 4; ours: applied to an impact, and a Newton correction from the band onto the hyper-surface.

    Example:
        >>> from vibrojax.contact import HuntCrossley
        >>> from vibrojax.excitation import Unforced, at_rest
        >>> from vibrojax.suspension import Free
        >>> system = System(0.5, Free(), HuntCrossley(1e6, 1.5, 0.3), 1e-3, at_rest(), Unforced())
        >>> motion = Switch()(system, jnp.array([0.0, 0.1]), jnp.array([0.0, 0.1]))
        >>> float(motion.v[-1].round(4))
        -0.098
    """

    rtol: float = 1e-11
    atol: float = 1e-14
    band: float = 1e-12
    max_steps: int = eqx.field(static=True, default=100_000)

    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, " states"]) -> Trajectory:
        """Integrate one trajectory of a system without effects; see `AbstractIntegrator`."""
        without_effects(system, "the switch integrator")
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=ts.dtype), system)
        carry = self._start(system, ts, state)
        nothing = jnp.zeros_like(ts)
        samples = _record(_Samples(nothing, nothing, nothing, jnp.zeros(ts.shape, bool)), carry, 0, jnp.asarray(True))

        def unfinished(loop):
            carry, _ = loop
            return (carry.sample < ts.shape[0]) & (carry.steps < self.max_steps) & (carry.result == SUCCESS)

        def advance(loop):
            carry, samples = loop
            after = self._trial(system, ts, carry)
            return after, _record(samples, after, carry.sample, after.sample > carry.sample)

        carry, samples = lax.while_loop(unfinished, advance, (carry, samples))
        missing = jnp.arange(ts.shape[0]) >= carry.sample
        u, v, approach_speed, in_contact = (jnp.where(missing, last, kept) for last, kept in zip(_row(carry), samples, strict=True))
        short = (carry.sample < ts.shape[0]) & (carry.result == SUCCESS)
        result = jnp.where(short, STEP_LIMIT, carry.result)
        return Trajectory(ts, u, v, in_contact, approach_speed, result, carry.steps, jnp.zeros((len(ts), 0), ts.dtype))

    def _start(self, system: System, ts: Float[Array, " time"], state: Float[Array, "2"]) -> _Carry:
        u, v = state[0], state[1]
        compliant = isinstance(system.law, AbstractCompliantLaw)
        integers = (jnp.asarray(1), jnp.asarray(0), jnp.asarray(SUCCESS))
        touching = (system.indentation(u) > self.band) & compliant
        speed = jnp.maximum(jnp.abs(v), SLOWEST_APPROACH)
        inside = _Carry(ts[0], u, v, speed, touching, 1e-2 * (ts[1] - ts[0]), jnp.asarray(jnp.inf), *integers)
        return self._pass_band(system, inside)

    def _trial(self, system: System, ts: Float[Array, " time"], carry: _Carry) -> _Carry:
        """One step of error-controlled length: accepted, or taken back because it is inaccurate, leaves its sub-space, or turns."""
        to_sample = ts[carry.sample] - carry.t
        h = lax.stop_gradient(jnp.minimum(carry.h_free, carry.h_limit))
        arrives = h >= to_sample
        h = jnp.where(arrives, to_sample, h)
        (u1, v1), (u_error, v_error) = _dopri8(system, carry, h)
        relative = jnp.maximum(
            jnp.abs(u_error) / (self.atol + self.rtol * jnp.maximum(jnp.abs(carry.u), jnp.abs(u1))),
            jnp.abs(v_error) / (self.atol + self.rtol * jnp.maximum(jnp.abs(carry.v), jnp.abs(v1))),
        )
        relative = lax.stop_gradient(relative)
        proposal = h * jnp.clip(_SAFETY * jnp.maximum(relative, 1e-10) ** -0.125, _SHRINKAGE, _GROWTH)

        outward = jnp.where(carry.in_contact, -1.0, 1.0)
        before, after = system.indentation(carry.u), system.indentation(u1)
        _, to_surface = crossing(outward * before, outward * carry.v, outward * after, outward * v1, h)
        leaves = outward * after > self.band
        turns = ~carry.in_contact & (carry.v > _TURN) & (v1 < -_TURN)
        to_turn = lax.stop_gradient(h * carry.v / jnp.where(turns, carry.v - v1, 1.0))

        inaccurate = relative > 1.0
        taken_back = carry._replace(
            h_free=jnp.where(inaccurate, lax.stop_gradient(proposal), carry.h_free),
            h_limit=jnp.where(inaccurate, jnp.inf, jnp.where(leaves, to_surface, to_turn)),
            steps=carry.steps + 1,
        )
        limited = arrives | jnp.isfinite(carry.h_limit)
        accepted = carry._replace(
            t=jnp.where(arrives, ts[carry.sample], carry.t + h),
            u=u1,
            v=v1,
            h_free=lax.stop_gradient(jnp.where(limited, jnp.maximum(carry.h_free, proposal), proposal)),
            h_limit=jnp.asarray(jnp.inf),
            sample=carry.sample + arrives.astype(int),
            steps=carry.steps + 1,
            result=jnp.where(jnp.isfinite(relative), carry.result, NOT_FINITE),
        )
        accepted = self._pass_band(system, accepted)
        return _where(inaccurate | leaves | turns, taken_back, accepted)

    def _pass_band(self, system: System, carry: _Carry) -> _Carry:
        """The rule of the band |h| <= eta: the normal component of the vector fields chooses the sub-space."""
        distance = system.indentation(carry.u)
        in_band = jnp.abs(distance) <= self.band
        leaving = in_band & jnp.where(carry.in_contact, carry.v < 0, carry.v > 0)
        acceleration = _acceleration(system, carry, carry.t, carry.u, carry.v)
        correction = landing_correction(distance, carry.v)
        v = carry.v + acceleration * correction
        passed = carry._replace(t=carry.t + correction, u=carry.u + carry.v * correction, v=v, in_contact=~carry.in_contact)
        touching = passed._replace(approach_speed=jnp.maximum(v, SLOWEST_APPROACH))
        if isinstance(system.law, AbstractInstantaneousLaw):
            rebound = system.law.rebound_speed(touching.approach_speed)
            chatters = (acceleration > 0) & (rebound**2 < 2.0 * acceleration * self.band)
            result = jnp.where(chatters, CHATTER, carry.result)
            touching = touching._replace(v=-rebound, in_contact=carry.in_contact, result=result)
        return _where(leaving, _where(carry.in_contact, passed, touching), carry)


def _acceleration(system: System, carry: _Carry, t: _Scalar, u: _Scalar, v: _Scalar) -> _Scalar:
    """u'' inside one sub-space, m/s^2."""
    return system.forces(t, u, v, jnp.zeros(0, u.dtype), carry.in_contact, carry.approach_speed).acceleration


def _dopri8(system: System, carry: _Carry, h: _Scalar):
    """State after h, and an estimate of its error, inside one sub-space."""

    def rates(t, y, _):
        u, v = y
        return v, _acceleration(system, carry, t, u, v)

    term, solver = diffrax.ODETerm(rates), diffrax.Dopri8(scan_kind="lax")
    y = (carry.u, carry.v)
    state = solver.init(term, carry.t, carry.t + h, y, None)
    y, error, _, _, _ = solver.step(term, carry.t, carry.t + h, y, None, state, made_jump=False)
    return y, error


def _row(carry: _Carry) -> _Samples:
    return _Samples(carry.u, carry.v, carry.approach_speed, carry.in_contact)


def _record(samples: _Samples, carry: _Carry, index: Int[Array, ""] | int, wanted: Bool[Array, ""]) -> _Samples:
    return jax.tree.map(lambda all_, one: all_.at[index].set(jnp.where(wanted, one, all_[index])), samples, _row(carry))


def _where(condition: Bool[Array, ""], yes: _Carry, no: _Carry) -> _Carry:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
