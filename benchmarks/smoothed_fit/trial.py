"""One contact law: the estimate of the chain, and that of the smoothed contact at each width."""

import dataclasses
import time

import jax.numpy as jnp
import numpy as np

from benchmarks.smoothed_fit.rig import simulated, true_model
from identification.trajectory.fit import Fitted, equations, fit
from identification.trajectory.motion import Estimate
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.smoothed import SMALL_GRADIENT, Smoothed, fit_smoothed
from identification.trajectory.start import Problem, problem_of
from identification.trajectory.step import moved
from identification.trajectory.variances import SMALLEST_FORCE, Variances
from vibrojax.integrate import Landing

_FINE, _FINER = 8.0, 16.0
"""Refinement of the steps of the exact contact, and that of the reference."""
_STEPS = 12
"""Gauss-Newton steps of the chain from the true parameters."""
_ABOVE = 4.0
"""A difference this many times what is left open counts for the slope."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Law:
    """Differences from the chain, by width, on records without noise: there both must find the true parameters, whatever weighs them.

    Attributes:
        name: of the contact law.
        parameters: names of the estimated parameters.
        stderr: their standard errors under the declared noise, in the coordinates of the fit.
        widths: m.
        shift: (widths, parameters): estimate less that of the chain, over its standard error.
        converged: (widths,)
        floor: what is left open: the largest shift between two chains, with steps of one and of half the length, and the distance in
            standard errors at which the smoothed fit stops.
        seconds: of a fit with the smoothed contact at each width, compiled.
    """

    name: str
    parameters: tuple[str, ...]
    stderr: np.ndarray
    widths: np.ndarray
    shift: np.ndarray
    converged: np.ndarray
    floor: float
    seconds: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        """Largest shift of a parameter at each width, in standard errors."""
        return np.abs(self.shift).max(axis=1)

    @property
    def slope(self) -> float:
        """Slope of the logarithm of the largest shift against that of the width, where it exceeds what is left open."""
        counted = self.largest > _ABOVE * self.floor
        if counted.sum() < 2:
            return float("nan")
        return float(np.polyfit(np.log(self.widths[counted]), np.log(self.largest[counted]), 1)[0])


def trial(law: str, widths: np.ndarray, *, samples: int) -> Law:
    """Fit the records of one law, without noise, by the chain and with the smoothed contact."""
    problem = problem_of(simulated(law, samples=samples, seed=0, noise=0.0))
    start = _from_truth(problem, law)
    exact, sigma = chain(finer(problem, _FINER), start)
    other, _ = chain(finer(problem, _FINE), exact)
    here = fit_smoothed(problem, exact, smoothing=float(widths.max())).estimate  # compiles
    found, seconds = [], []
    for width in np.sort(widths)[::-1]:  # from afar: an estimate that began at the answer would show nothing
        before = time.perf_counter()
        found.append(fit_smoothed(problem, here, smoothing=float(width)))
        seconds.append(time.perf_counter() - before)
        here = found[-1].estimate
    return Law(
        name=law,
        parameters=tuple(p.name for p in problem.parameters),
        stderr=sigma,
        widths=np.sort(widths)[::-1],
        shift=np.array([(one.estimate.shared - exact.shared) / sigma for one in found]),
        converged=np.array([one.converged for one in found]),
        floor=max(float(np.abs((other.shared - exact.shared) / sigma).max()), SMALL_GRADIENT),
        seconds=np.array(seconds),
    )


def whole(law: str, width: float, *, samples: int, seed: int) -> tuple[Fitted, Smoothed]:
    """Noisy records fitted by the chain, and from its answer and with its reading errors by the smoothed contact."""
    found = fit(problem_of(simulated(law, samples=samples, seed=seed)))
    return found, fit_smoothed(found.problem, found.at, smoothing=width, readings=found.variances.readings)


def finer(problem: Problem, refinement: float) -> Problem:
    """The problem with shorter steps through its segments."""
    usual = problem.integrator
    steps = Landing(contact_steps=refinement * jnp.asarray(usual.contact_steps), flight_step=jnp.asarray(usual.flight_step) / refinement)
    return dataclasses.replace(problem, integrator=steps)


def chain(problem: Problem, start: Estimate) -> tuple[Estimate, np.ndarray]:
    """Estimate of a chain without a random force, as near as it gets to none, and standard errors of the shared parameters."""
    force = RandomForce(std=SMALLEST_FORCE * problem.scales.force, memory=2.0 * float(np.median(problem.chains.duration)))
    held, at = Variances(force=force, readings=tuple(ReadingError() for _ in problem.chains.channels)), start
    for _ in range(_STEPS):
        at = moved(problem, at, equations(problem, at, held)[2], 1.0)
    error = np.sqrt(np.diag(equations(problem, at, held)[2].covariance))
    return dataclasses.replace(at, force=np.zeros_like(at.force)), error * problem.border.shared_scale


def _from_truth(problem: Problem, law: str) -> Estimate:
    """The first estimate with the parameters that made the records."""
    true = true_model(law).values()
    shared = [np.log(true[name]) if logarithmic else true[name] for name, logarithmic in problem.unknowns.shared]
    return dataclasses.replace(problem.start, shared=np.array(shared))
