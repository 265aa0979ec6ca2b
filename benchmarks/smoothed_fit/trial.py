"""One contact law: the least-squares estimate of the exact contact, and that of the smoothed one at each width."""

import dataclasses
import time

import numpy as np

from benchmarks.smoothed_fit.rig import simulated
from identification.least_squares.block_arrow import reduce, solve
from identification.least_squares.fit import evaluator, fit, free_unknowns, integrator_for, landing_for
from identification.least_squares.uncertainty import uncertainty
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, prepare
from vibrojax.integrate import AbstractBatchIntegrator, Landing

_FINE, _FINER = 8.0, 16.0
"""Refinement of the steps of the exact contact, and that of the reference."""
_REFINED = 2.0
"""Refinement of the smoothed integrator, whose error falls with its eighth power."""
_STEPS = 8
"""Gauss-Newton steps, which converge from the optimum of another width."""
_ABOVE = 4.0
"""A difference this many times that of the two exact integrations counts for the slope."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Law:
    """Differences from the exact contact, by width.

    Attributes:
        name: of the contact law.
        parameters: names of the estimated parameters.
        stderr: their standard errors with the exact contact, in the coordinates of the fit.
        widths: m.
        shift: (widths, parameters): estimate less that of the exact contact, over its standard error.
        widening: (widths, parameters): relative difference of the standard errors.
        floor: the largest shift and widening between two exact integrations, with steps of one and of half the length.
        seconds: of one evaluation of residuals and derivatives: "landing", "smoothed".
    """

    name: str
    parameters: tuple[str, ...]
    stderr: np.ndarray
    widths: np.ndarray
    shift: np.ndarray
    widening: np.ndarray
    floor: dict[str, float]
    seconds: dict[str, float]

    @property
    def largest(self) -> dict[str, np.ndarray]:
        """Largest difference over the parameters at each width: of estimates in standard errors, of standard errors relative."""
        return {"estimate": np.abs(self.shift).max(axis=1), "stderr": np.abs(self.widening).max(axis=1)}

    def slope(self, quantity: str) -> float:
        """Slope of the logarithm of the largest difference against that of the width, where it exceeds what integration leaves open."""
        values = self.largest[quantity]
        counted = values > _ABOVE * self.floor[quantity]
        if counted.sum() < 2:
            return float("nan")
        return float(np.polyfit(np.log(self.widths[counted]), np.log(values[counted]), 1)[0])


def trial(law: str, widths: np.ndarray, *, samples: int, seed: int) -> Law:
    """Fit the records of one law with the exact and the smoothed contact."""
    prepared = prepare(simulated(law, samples=samples, seed=seed))
    start = fit(prepared).estimate
    exact, sigma = optimum(prepared, _fine(prepared, _FINER), start)
    other, others = optimum(prepared, _fine(prepared, _FINE), exact)
    shift, widening = [], []
    here = exact
    for width in np.sort(widths):
        smooth = dataclasses.replace(prepared, smoothing=float(width))
        here, spread = optimum(smooth, integrator_for(smooth, refinement=_REFINED), here)
        shift.append((here.shared - exact.shared) / sigma)
        widening.append(spread / sigma - 1.0)
    usual = dataclasses.replace(prepared, smoothing=float(widths.min()))
    return Law(
        name=law,
        parameters=tuple(p.name for p in prepared.layout.parameters),
        stderr=sigma,
        widths=np.sort(widths),
        shift=np.array(shift),
        widening=np.array(widening),
        floor={
            "estimate": float(np.abs((other.shared - exact.shared) / sigma).max()),
            "stderr": float(np.abs(others / sigma - 1.0).max()),
        },
        seconds={name: _clocked(one, exact) for name, one in (("landing", prepared), ("smoothed", usual))},
    )


def optimum(prepared: Prepared, integrator: AbstractBatchIntegrator, start: Estimate) -> tuple[Estimate, np.ndarray]:
    """Least-squares estimate by Gauss-Newton steps to rounding, and standard errors of the shared parameters."""
    evaluate, active, estimate = evaluator(prepared, integrator), free_unknowns(prepared), start
    for _ in range(_STEPS):
        equations = evaluate(estimate)
        estimate = estimate.moved(*solve(reduce(equations, estimate, active, 0.0), equations, estimate))
    return estimate, uncertainty(evaluate(estimate), estimate, active).stderr[: prepared.layout.shared]


def _fine(prepared: Prepared, refinement: float) -> Landing:
    usual = landing_for(prepared, refinement=refinement)
    return dataclasses.replace(usual, most_steps=int(refinement) * (usual.most_steps or 0))


def _clocked(prepared: Prepared, estimate: Estimate) -> float:
    """Seconds of one evaluation with the steps that a fit takes, the best of three."""
    evaluate, seconds = evaluator(prepared, integrator_for(prepared)), []
    for _ in range(4):
        before = time.perf_counter()
        evaluate(estimate)
        seconds.append(time.perf_counter() - before)
    return min(seconds[1:])
