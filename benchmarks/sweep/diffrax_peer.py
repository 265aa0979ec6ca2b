"""Plain `jax.vmap` of `diffrax.diffeqsolve`: what one would write with Diffrax alone, save at every strobe."""

from collections.abc import Callable
from functools import lru_cache

import diffrax
import jax
import jax.numpy as jnp
import numpy as np


def _rates(t, y, arguments):
    omega, p = arguments
    u, v = y
    delta = jnp.maximum(u - p[6], 0.0)
    push = p[3] * delta ** p[4] * jnp.maximum(1.0 + p[5] * v, 0.0) / p[0]
    return v, p[7] * omega**2 * jnp.sin(omega * t) - p[1] * v - p[2] * u - push


@lru_cache
def _program(cycles: int, rtol: float) -> Callable:
    controller = diffrax.PIDController(rtol=rtol, atol=1e-2 * rtol, pcoeff=0.3, icoeff=0.4)

    def lane(frequency, p):
        strobes = jnp.arange(1, cycles + 1) / frequency
        return diffrax.diffeqsolve(
            diffrax.ODETerm(_rates),
            diffrax.Tsit5(),
            t0=0.0,
            t1=strobes[-1],
            dt0=1e-3 / frequency,
            y0=(jnp.zeros(()), jnp.zeros(())),
            args=(2 * jnp.pi * frequency, p),
            saveat=diffrax.SaveAt(ts=strobes),
            stepsize_controller=controller,
            max_steps=None,
        ).ys

    return jax.jit(jax.vmap(lane, in_axes=(0, None)))


def diffrax_sweep(frequencies: np.ndarray, cycles: int, p: np.ndarray, rtol: float) -> np.ndarray:
    """Sections of every lane, (lanes, cycles, 2)."""
    u, v = _program(cycles, rtol)(jnp.asarray(frequencies), jnp.asarray(p))
    return np.stack([np.asarray(u), np.asarray(v)], axis=-1)
