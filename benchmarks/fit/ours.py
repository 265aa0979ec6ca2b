"""The program's own side of the comparison."""

import dataclasses
import time
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from identification.estimation.multistart import Multistart
from identification.least_squares.fit import as_arrays, fit, free_unknowns, integrator_for, on_device
from identification.least_squares.levenberg_marquardt import Outcome
from identification.least_squares.residual import residuals, weighted_residual
from identification.least_squares.uncertainty import uncertainty
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared


@dataclasses.dataclass(frozen=True, kw_only=True)
class OurFit:
    """Where our fit ended, and how long it took."""

    outcome: Outcome
    seconds: tuple[float, ...]
    """Of every run but the first."""
    first_seconds: float
    """Of the run that compiled, or fetched what the cache on disk holds."""
    sigma: np.ndarray
    """Standard errors of the shared parameters, internal coordinates."""


def our_fit(prepared: Prepared, *, repeats: int) -> OurFit:
    """Fit from `prepared.start`, once to compile and `repeats` times for the clock."""
    first, outcome = timed(lambda: fit(prepared))
    seconds = tuple(timed(lambda: fit(prepared))[0] for _ in range(repeats))
    active = free_unknowns(prepared)
    spread = uncertainty(outcome.equations, outcome.estimate, active)
    return OurFit(outcome=outcome, seconds=seconds, first_seconds=first, sigma=spread.stderr[: prepared.layout.shared])


def screened(prepared: Prepared) -> Prepared:
    """The same at the start that the program chooses among several."""
    shared, _ = Multistart()(prepared, seed=0)
    return dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=shared))


def our_residuals(prepared: Prepared, estimate: Estimate) -> np.ndarray:
    """(samples of all windows, channels), as the fit's integrator gives them."""
    (group,) = prepared.groups
    local = jnp.asarray(estimate.local(prepared.record))
    found, _ = residuals(as_arrays(prepared.model), prepared.layout, integrator_for(prepared), on_device(group), local)
    return np.concatenate([np.asarray(found[lane, :samples]) for lane, samples in enumerate(group.lengths)])


def jacobian_cost(prepared: Prepared, estimate: Estimate, *, repeats: int) -> tuple[float, float]:
    """Seconds of one simulation of all windows, and of its value and Jacobian in the shared parameters; compiled before."""
    (group,) = prepared.groups
    arguments = (as_arrays(prepared.model), prepared.layout, integrator_for(prepared), on_device(group))
    local = jnp.asarray(estimate.local(prepared.record))
    simulation = best_time(lambda: residuals(*arguments, local), repeats)
    return simulation, best_time(lambda: _value_and_jacobian(*arguments, local), repeats)


@eqx.filter_jit
def _value_and_jacobian(model, layout, integrator, windows, local):
    """Residuals of all windows and their derivatives with respect to the shared parameters only."""

    def along(direction):
        def value(vectors):
            return weighted_residual(model, layout, integrator, windows, vectors)

        return jax.jvp(value, (local,), (jnp.broadcast_to(direction, local.shape),), has_aux=True)

    return jax.vmap(along, out_axes=(None, 0, None))(jnp.eye(layout.size)[: layout.shared])


def timed(call: Callable):
    """Wall seconds of a call, and what it returned."""
    before = time.perf_counter()
    result = call()
    return time.perf_counter() - before, result


def best_time(call: Callable, repeats: int) -> float:
    """Least wall seconds of a call after one that compiles."""
    jax.block_until_ready(call())
    return min(timed(lambda: jax.block_until_ready(call()))[0] for _ in range(repeats))
