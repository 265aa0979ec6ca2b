"""Every engine of the comparison at several accuracies: time and error of each."""

import dataclasses
import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.sweep.diffrax_peer import diffrax_sweep
from benchmarks.sweep.numba_peer import numba_sweep
from benchmarks.sweep.problem import Problem, Reference, error
from benchmarks.sweep.scipy_peers import scipy_lane
from vibrojax.batch import ExactFlight, Span, grid, integrate

CONTACT_STEPS = (6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 20.0)
TOLERANCES = {
    "numba": (1e-5, 1e-6, 1e-7, 1e-8, 1e-9),
    "diffrax_vmap": (1e-5, 1e-7, 1e-8),
    "scipy_lsoda": (1e-6, 1e-8, 1e-9),
    "scipy_dop853": (1e-6, 1e-8, 1e-9),
}
REFERENCE_STEPS = 160.0
_CLOSED = 1e-8


@dataclasses.dataclass(frozen=True, kw_only=True)
class Run:
    """One engine at one accuracy."""

    engine: str
    setting: float
    """Steps in contact, or relative tolerance."""
    seconds: float
    miss: dict[str, float]
    """Error of the last section point over the base amplitude: `median` and `quantile90` of the periodic lanes."""
    scaled_from: int | None = None
    """Lanes that were timed, where not all were."""


def our_sections(problem: Problem, contact_steps: float, *, closed: float | None = None) -> np.ndarray:
    """Last section displacement of every lane, m."""
    points = grid({"frequency_hz": problem.frequencies}, base_amplitude=problem.base_amplitude, gap=problem.gap)
    span = Span(transient=problem.cycles - 10, recorded=10, closed=closed)
    found = integrate(problem.model, points, span=span, engine=ExactFlight(contact_steps=contact_steps))
    if found.failures:
        raise RuntimeError(f"lanes failed: {found.failures}")
    return found.u


def reference(problem: Problem) -> Reference:
    """Section points of our fast path at 160 contact steps, checked against DOP853 by `check`; and which orbits have closed by then."""
    u = our_sections(problem, REFERENCE_STEPS)
    last = u[:, -1]
    periodic = np.zeros(problem.lanes, dtype=bool)
    for q in range(1, 5):
        periodic |= np.abs(u[:, -1 - q] - last) < _CLOSED * problem.base_amplitude
    return Reference(u=last, periodic=periodic)


def check(problem: Problem, truth: Reference, lanes: int) -> float:
    """Largest distance of the reference from SciPy's DOP853 at 1e-12, on some periodic lanes, over the base amplitude."""
    index = np.flatnonzero(truth.periodic)
    index = index[np.linspace(0, index.size - 1, lanes).astype(int)]
    p, cycles = problem.numbers, problem.cycles
    exact = np.array([scipy_lane("DOP853", float(problem.frequencies[i]), cycles, p, 1e-12)[-1, 0] for i in index])
    return float(np.max(np.abs(exact - truth.u[index])) / problem.base_amplitude)


def runs(problem: Problem, truth: Reference, *, repeats: int, scipy_lanes: int) -> Iterator[Run]:
    """Every engine at every accuracy: compiled before, the best of `repeats` timings.

    SciPy on some of the lanes whose orbit has closed, which alone tell an error; its time is scaled to all.
    """
    f, cycles, p = problem.frequencies, problem.cycles, problem.numbers
    for steps in CONTACT_STEPS:
        seconds, u = best(lambda steps=steps: our_sections(problem, steps)[:, -1], repeats)
        yield Run(engine="ours", setting=steps, seconds=seconds, miss=error(problem, truth, u))
    for rtol in TOLERANCES["numba"]:
        seconds, u = best(lambda rtol=rtol: numba_sweep(f, cycles, p, rtol)[:, -1, 0], repeats)
        yield Run(engine="numba", setting=rtol, seconds=seconds, miss=error(problem, truth, u))
    for rtol in TOLERANCES["diffrax_vmap"]:
        seconds, u = best(lambda rtol=rtol: diffrax_sweep(f, cycles, p, rtol)[:, -1, 0], repeats)
        yield Run(engine="diffrax_vmap", setting=rtol, seconds=seconds, miss=error(problem, truth, u))
    closed = np.flatnonzero(truth.periodic)
    some = closed[np.linspace(0, closed.size - 1, min(scipy_lanes, closed.size)).astype(int)]
    part = Reference(u=truth.u[some], periodic=truth.periodic[some])
    for method in ("LSODA", "DOP853"):
        for rtol in TOLERANCES[f"scipy_{method.lower()}"]:

            def lanes(method=method, rtol=rtol) -> np.ndarray:
                return np.array([scipy_lane(method, float(f[i]), cycles, p, rtol)[-1, 0] for i in some])

            seconds, u = best(lanes, repeats)
            scaled = seconds * problem.lanes / some.size
            yield Run(
                engine=f"scipy_{method.lower()}", setting=rtol, seconds=scaled, scaled_from=int(some.size), miss=error(problem, part, u)
            )


def best(work: Callable[[], np.ndarray], repeats: int) -> tuple[float, np.ndarray]:
    """Shortest wall time of the work after one call that compiles it, s, and its answer."""
    found, times = work(), []
    for _ in range(repeats):
        begin = time.perf_counter()
        found = work()
        times.append(time.perf_counter() - begin)
    return min(times), found


def seconds_at(found: list[Run], engine: str, wanted: float) -> float | None:
    """Time of an engine at a median error, from the straight line between its neighbours in log-log; None where it reaches no such error.

    An engine that is more accurate than wanted at its coarsest setting is given the time of that setting.
    """
    mine = sorted((run for run in found if run.engine == engine), key=lambda run: run.miss["median"])
    if not mine or mine[0].miss["median"] > wanted:
        return None
    errors, times = np.log([run.miss["median"] for run in mine]), np.log([run.seconds for run in mine])
    return float(np.exp(np.interp(np.log(wanted), errors, times)))
