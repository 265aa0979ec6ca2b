"""A step-size controller that keeps an adaptive solver from stepping over a narrow contact switch."""

import diffrax
import equinox as eqx
import jax.numpy as jnp
from jax import lax

from vibrojax.shapes import Number


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
        """Relative tolerance of the error control."""
        return self.error_control.rtol

    @property
    def atol(self):
        """Absolute tolerance of the error control."""
        return self.error_control.atol

    def wrap(self, direction):
        """See Diffrax."""
        return eqx.tree_at(lambda self: self.error_control, self, self.error_control.wrap(direction))

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):
        """See Diffrax."""
        t_first, state = self.error_control.init(terms, t0, t1, y0, dt0, args, func, error_order)
        return jnp.minimum(t_first, t0 + self._bound(y0, args)), state

    def adapt_step_size(self, t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state):
        """See Diffrax."""
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
