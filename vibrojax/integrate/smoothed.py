"""Diffrax on the contact law with a smoothed switch, its steps bounded so that none passes over the switch unseen."""

from typing import Any, cast

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from vibrojax import smooth
from vibrojax.contact import AbstractCompliantLaw, smoothed_force
from vibrojax.contact.base import SLOWEST_APPROACH, uses_approach_speed
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory, without_effects
from vibrojax.shapes import Number
from vibrojax.system import System


class BoundarySteps(diffrax.AbstractStepSizeController):
    """Error control whose steps end near the contact switch before they pass it.

    At distance d outside the smoothed width epsilon, a step is at most the time in which the present velocity covers d + epsilon/4; inside
    the width, epsilon/4. However narrow the width, a passage thus takes a few steps in it, whatever the error estimate saw.

    Expects a state that begins with (u, u'), and the `System` as arguments of the equation.

    Arguments:
        error_control: the controller that proposes steps.
        smoothing: epsilon, m.

    Source: ours; the form of a wrapping controller is that of `diffrax.ClipStepSizeController`.
    """

    error_control: diffrax.AbstractAdaptiveStepSizeController
    smoothing: Number

    @property
    def rtol(self):
        return self.error_control.rtol

    @property
    def atol(self):
        return self.error_control.atol

    def wrap(self, direction):
        return eqx.tree_at(lambda self: self.error_control, self, self.error_control.wrap(direction))

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):
        t_first, state = self.error_control.init(terms, t0, t1, y0, dt0, args, func, error_order)
        return jnp.minimum(t_first, t0 + self._bound(y0, args)), state

    def adapt_step_size(self, t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state):
        keep, start, end, jump, state, result = self.error_control.adapt_step_size(
            t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state
        )
        u, v = (jnp.where(keep, after, before) for after, before in zip(y1_candidate[:2], y0[:2], strict=True))
        return keep, start, jnp.minimum(end, start + self._bound((u, v), args)), jump, state, result

    def _bound(self, y, system):
        """Longest step from this state, s."""
        u, v = lax.stop_gradient(y[0]), lax.stop_gradient(y[1])
        distance = jnp.maximum(jnp.abs(system.indentation(u)) - 0.5 * self.smoothing, 0.0)
        return lax.stop_gradient((distance + 0.25 * self.smoothing) / jnp.maximum(jnp.abs(v), 1e-9))


_SHORTEST_STEP = 1e-14
"""s; error control that asks for less has met a right-hand side that is not finite."""


class Smoothed(AbstractIntegrator):
    """Adaptive Runge-Kutta of the contact law with its switch spread over a width epsilon, in one go through all impacts.

    m u'' + ... = -F_eps(delta, delta'), F_eps as in `vibrojax.contact.smoothed_force`: the right-hand side is continuous, so that any
    solver, adjoint and controller of Diffrax applies. The motion converges to that of the discontinuous law (`Switch`, `Landing`) as
    epsilon -> 0, at the price of short steps through the width.

    Laws that need the speed at the touch get it from a third state, w' = (1 - H_eps(delta)) (u'' + (u' - w) / tau): w equals u' in
    flight, is frozen in contact, and after the release returns to u' within `memory`, tau, which must be short against a flight and
    long against a passage through the width. Laws that do not use it are integrated without that state; then `approach_speed` of
    the trajectory is nothing but u'. In flight, too, it is u' and not the speed of the last touch.

    Differentiable, in the mode of `adjoint`, wherever a motion does not graze: forward mode by default, reverse mode with
    `diffrax.RecursiveCheckpointAdjoint()`.

    Arguments:
        smoothing: epsilon > 0, m.
        rtol: relative error of a step.
        atol: absolute error of a step, in m and m/s.
        longest_step: s; also the time within which an impact may hide from the error control, if it is that short.
        memory: tau, s.
        solver: of Diffrax, with an error estimate.
        adjoint: of Diffrax.
        max_steps: `STEP_LIMIT` after this many steps.

    Source: P. Kidger, On neural differential equations, PhD thesis, Oxford 2021 (Diffrax); the state w and the step bound are ours.

    Example:
        >>> from vibrojax.contact import HuntCrossley
        >>> from vibrojax.excitation import Unforced, at_rest
        >>> from vibrojax.suspension import Free
        >>> system = System(0.5, Free(), HuntCrossley(1e6, 1.5, 0.3), 1e-3, at_rest(), Unforced())
        >>> motion = Smoothed(smoothing=1e-6)(system, jnp.array([0.0, 0.1]), jnp.array([0.0, 0.1]))
        >>> float(motion.v[-1].round(4))
        -0.098
    """

    smoothing: Number
    rtol: Number = 1e-8
    atol: Number = 1e-11
    longest_step: Number = 5e-3
    memory: float = 1e-3
    solver: diffrax.AbstractAdaptiveSolver = diffrax.Dopri8()
    adjoint: diffrax.AbstractAdjoint = diffrax.ForwardMode()
    max_steps: int = eqx.field(static=True, default=100_000)

    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, " states"]) -> Trajectory:
        """Integrate one trajectory of a system without effects; see `AbstractIntegrator`.

        One that begins in contact takes the speed at its touch, m/s, from a third number of the state; without, u' stands in for it.
        """
        without_effects(system, "the smoothed integrator")
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=ts.dtype), system)
        if not isinstance(system.law, AbstractCompliantLaw):
            raise TypeError(f"a rigid stop ({system.law.name}) has no force to smooth: integrate it with the landing or switch integrator")
        uses_speed = uses_approach_speed(system.law)
        u, v, touched = (*state, state[1])[:3]
        w = jnp.where(system.indentation(u) > 0, touched, v)
        error_control = diffrax.PIDController(
            rtol=self.rtol, atol=self.atol, dtmax=self.longest_step, dtmin=_SHORTEST_STEP, force_dtmin=False, pcoeff=0.3, icoeff=0.4
        )
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(self._rates),
            self.solver,
            t0=ts[0],
            t1=ts[-1],
            dt0=1e-2 * (ts[1] - ts[0]),
            y0=(u, v, w) if uses_speed else (u, v),
            args=system,
            saveat=diffrax.SaveAt(ts=ts),
            stepsize_controller=BoundarySteps(error_control, self.smoothing),
            adjoint=self.adjoint,
            max_steps=self.max_steps,
            throw=False,
        )
        ys = cast(tuple[Array, ...], solution.ys)
        us, vs, ws = (*ys, ys[1])[:3]
        stopped = jnp.where(solution.result == diffrax.RESULTS.max_steps_reached, STEP_LIMIT, NOT_FINITE)
        result = jnp.where(solution.result == diffrax.RESULTS.successful, SUCCESS, stopped)
        own = jnp.zeros((*ts.shape, 0), ts.dtype)
        return Trajectory(ts, us, vs, system.indentation(us) > 0, ws, result, solution.stats["num_steps"], own)

    def _rates(self, t: Any, y: tuple[Float[Array, ""], ...], system: System) -> tuple[Float[Array, ""], ...]:
        """Right-hand side of (u, v) or of (u, v, w)."""
        u, v, w = (*y, y[1])[:3]
        law: Any = system.law
        push = smoothed_force(law, system.indentation(u), v, jnp.maximum(w, SLOWEST_APPROACH), self.smoothing)
        drive = (system.applied.force(t) + system.load - push) / system.mass - system.base.acceleration(t)
        acceleration = system.suspension.acceleration(u, v, drive)
        if len(y) == 2:
            return v, acceleration
        in_flight = 1.0 - smooth.step(system.indentation(u), self.smoothing)
        return v, acceleration, in_flight * (acceleration + (v - w) / self.memory)
