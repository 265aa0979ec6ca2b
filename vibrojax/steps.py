"""One step of an integration: the classical Runge-Kutta formula, and the cubic through the ends of a step."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax import lax

from vibrojax.shapes import Number, Scalars

State = TypeVar("State")
"""A tree of arrays."""


def runge_kutta_step(rates: Callable[[Scalars, State], State], t: Number, state: State, h: Number) -> tuple[State, State]:
    """State after a step of the classical Runge-Kutta formula of order four, and the rates at its last stage.

    The stages are a loop: compiled once instead of four times, which is most of what a fit of short records waits for.

    Arguments:
        rates: of the state, from the time and the state.
        t: at the beginning, s.
        state: there.
        h: length of the step, s; a number, or one for each element of the state.

    Source: W. Kutta, Beitrag zur näherungsweisen Integration totaler Differentialgleichungen, Z. Math. Phys. 46 (1901) 435-453.

    Example:
        >>> after, _ = runge_kutta_step(lambda t, y: -y, 0.0, jnp.asarray(1.0), 0.1)
        >>> round(float(after), 5)
        0.90484
    """

    def stage(loop, weights):
        slope, total = loop
        reach, share = weights
        slope = rates(t + reach * h, jax.tree.map(lambda one, rate: one + reach * h * rate, state, slope))
        return (slope, jax.tree.map(lambda one, rate: one + share * rate, total, slope)), None

    none = jax.tree.map(jnp.zeros_like, state)
    weights = jnp.array([[0.0, 1 / 6], [0.5, 1 / 3], [0.5, 1 / 3], [1.0, 1 / 6]], jnp.result_type(*jax.tree.leaves(state)))
    (slope, total), _ = lax.scan(stage, (none, none), weights)
    return jax.tree.map(lambda one, rate: one + h * rate, state, total), slope


def cubic(s: Scalars, p0: Scalars, m0: Scalars, p1: Scalars, m1: Scalars) -> tuple[Scalars, Scalars]:
    """Value and slope at s of the cubic with these values and slopes at 0 and 1 (Hermite).

    Example:
        >>> one = jnp.asarray(1.0)
        >>> [float(part) for part in cubic(0.5 * one, 0 * one, one, 0 * one, -one)]
        [0.25, 0.0]
    """
    c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, m0 + m1 - 2.0 * (p1 - p0)
    return p0 + s * (m0 + s * (c2 + s * c3)), m0 + s * (2.0 * c2 + 3.0 * s * c3)


def cubic_top(p0: Scalars, m0: Scalars, p1: Scalars, m1: Scalars) -> Scalars:
    """Largest value on [0, 1] of the cubic with these values and slopes at 0 and 1.

    Looked for inside only where the cubic rises at 0 and falls at 1; elsewhere the larger end is returned.

    Example:
        >>> one = jnp.asarray(1.0)
        >>> float(cubic_top(0 * one, one, 0 * one, -one))
        0.25
    """
    turns = (m0 > 0) & (m1 < 0)
    c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, m0 + m1 - 2.0 * (p1 - p0)
    root = jnp.sqrt(jnp.maximum(c2 * c2 - 3.0 * c3 * m0, 0.0))
    sigma = jnp.where(turns, m0 / jnp.where(turns, root - c2, 1.0), 0.0)
    return jnp.where(turns, p0 + sigma * (m0 + sigma * (c2 + sigma * c3)), jnp.maximum(p0, p1))
