"""Digital filters of first order on the samples of a channel, as recorders and amplifiers apply them.

Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order.
"""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from vibrojax.shapes import Value


def low_passed(
    ts: Float[Array, " time"], values: Float[Array, "time ..."], time_constant: Value, memory: Float[Array, "..."]
) -> Float[Array, "time ..."]:
    """Samples behind a low-pass: r_i = a_i r_(i-1) + (1 - a_i) x_i from r_0 = x_0 + memory on, a_i = exp(-(t_i - t_(i-1)) / tau).

    The memory d = r - x obeys d_i = a_i (d_(i-1) + x_(i-1) - x_i). With tau = 0 there is none, whatever is given, and r = x.
    Beside an analogue filter of the same tau the output comes half a sample early. Differentiable for tau > 0.
    """
    filters = jnp.asarray(time_constant) > 0
    exponent = jnp.where(filters, -jnp.diff(ts) / jnp.where(filters, time_constant, 1.0), -jnp.inf)
    return _followed(exponent, values, values[0] + jnp.where(filters, memory, 0.0))


def high_passed(
    ts: Float[Array, " time"], values: Float[Array, "time ..."], time_constant: Value, memory: Float[Array, "..."]
) -> Float[Array, "time ..."]:
    """Samples behind a high-pass: r_i = a_i (r_(i-1) + x_i - x_(i-1)) from r_0 = x_0 + memory on, a_i = exp(-(t_i - t_(i-1)) / tau).

    The memory d = r - x obeys d_i = a_i d_(i-1) + (a_i - 1) x_i: it is what a low-pass of the same tau would show, turned round.
    Differentiable for tau > 0.
    """
    return values - _followed(-jnp.diff(ts) / time_constant, values, -memory)


def _followed(exponent: Float[Array, " later"], values: Float[Array, "time ..."], start: Float[Array, "..."]) -> Float[Array, "time ..."]:
    """l_i = a_i l_(i-1) + (1 - a_i) x_i with a_i = exp(exponent_i), and `start` before them."""

    def follow(before, sample):
        kept, fresh, value = sample
        after = kept * before + fresh * value
        return after, after

    _, later = lax.scan(follow, start, (jnp.exp(exponent), -jnp.expm1(exponent), values[1:]))
    return jnp.concatenate([start[None], later])
