"""The program's own side of the comparison."""

import dataclasses
import time
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.fit.windows import Point, Windows
from identification.trajectory.fit import Fitted, fit
from identification.trajectory.motion import passed, vectors_of
from identification.trajectory.start import Problem
from vibrojax.channels import channels
from vibrojax.excitation import Harmonic, Unforced


@dataclasses.dataclass(frozen=True, kw_only=True)
class OurFit:
    """Where our fit ended, and how long it took."""

    fitted: Fitted
    seconds: tuple[float, ...]
    """Of every run but the first."""
    first_seconds: float
    """Of the run that compiled, or fetched what the cache on disk holds."""


def our_fit(problem: Problem, *, repeats: int) -> OurFit:
    """Fit from the first guess, once to compile and `repeats` times for the clock."""
    first, fitted = timed(lambda: fit(problem))
    return OurFit(fitted=fitted, seconds=tuple(timed(lambda: fit(problem))[0] for _ in range(repeats)), first_seconds=first)


def our_residuals(problem: Problem, windows: Windows, at: Point) -> np.ndarray:
    """(samples of all windows, channels), as the fit's integrator gives them."""
    lanes, longest = len(windows.record), int(windows.counts.max())
    rows = windows.offsets[:, None] + np.minimum(np.arange(longest), windows.counts[:, None] - 1)
    step = np.array([np.median(np.diff(windows.time[r[:n]])) for r, n in zip(rows, windows.counts, strict=True)])
    ts = windows.time[windows.offsets][:, None] + step[:, None] * np.arange(longest)
    base = at.nuisances[windows.record]
    model = jax.tree.map(jnp.asarray, problem.model_at(dataclasses.replace(problem.start, shared=at.shared)))

    def system(gap, amplitude, phase, hz):
        return model.system(gap=gap, base=Harmonic(amplitude, phase, hz), applied=Unforced())

    @eqx.filter_jit
    def shown(ts, states, *settings):
        systems = jax.vmap(system)(*settings)
        paths = problem.integrator.batch(systems, ts, states, jnp.asarray(windows.counts))
        by_lane = eqx.tree_at(lambda one: one.steps, paths, jnp.zeros(lanes, int))
        return jax.vmap(channels)(systems, by_lane)

    settings = (windows.gap + base[:, 2], base[:, 0], base[:, 1], windows.frequency_hz)
    found = shown(jnp.asarray(ts), jnp.asarray(at.states), *map(jnp.asarray, settings))
    predicted = np.stack([np.asarray(found[name]) for name in windows.channels], axis=-1)
    flat = np.concatenate([predicted[lane, : windows.counts[lane]] for lane in range(lanes)])
    return (windows.measured - flat) * windows.weight


def jacobian_cost(fitted: Fitted, *, repeats: int) -> tuple[float, float]:
    """Seconds of one pass along all segments, and of its value and Jacobian in the shared parameters; compiled before."""
    problem = fitted.problem
    (group,) = problem.chains.groups
    arguments = (jax.tree.map(jnp.asarray, problem.model_at(fitted.at)), problem.unknowns, problem.chains.files, problem.integrator, group)
    vectors = jnp.asarray(vectors_of(problem.chains, fitted.at)[group.place])
    first = len(problem.unknowns.states) + 2
    directions = jnp.eye(problem.unknowns.columns)[first : first + len(problem.unknowns.shared)]
    simulation = best_time(lambda: _value(*arguments, vectors), repeats)
    return simulation, best_time(lambda: _value_and_jacobian(*arguments, vectors, directions), repeats)


_value = eqx.filter_jit(passed)


@eqx.filter_jit
def _value_and_jacobian(model, unknowns, files, integrator, segments, vectors, directions):
    def along(direction):
        function = lambda moved: passed(model, unknowns, files, integrator, segments, moved)  # noqa: E731
        return jax.jvp(function, (vectors,), (jnp.broadcast_to(direction, vectors.shape),), has_aux=True)

    return jax.vmap(along, out_axes=(None, 0, None))(directions)


def timed(call: Callable):
    """Wall seconds of a call, and what it returned."""
    before = time.perf_counter()
    result = call()
    return time.perf_counter() - before, result


def best_time(call: Callable, repeats: int) -> float:
    """Least wall seconds of a call after one that compiles."""
    jax.block_until_ready(call())
    return min(timed(lambda: jax.block_until_ready(call()))[0] for _ in range(repeats))
