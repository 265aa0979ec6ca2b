"""Staged least-squares fit: suspension from free flight, contact law from impacts, then all parameters together."""

import dataclasses
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from identification.least_squares.block_arrow import Equations
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt, Outcome, settle
from identification.least_squares.priors import with_prior
from identification.least_squares.residual import normal_equations
from identification.windows.lanes import chunked
from identification.windows.layout import Active, Estimate, free_nuisances
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows
from vibrojax.integrate import AbstractBatchIntegrator, Landing
from vibrojax.integrate.landing import flight_step
from vibrojax.model import Model

Progress = Callable[[str, int, float], None]
_STEPS_PER_PERIOD = 96.0
"""Integration steps per period of the fastest vibration, in flight."""
_STEPS_PER_OWN_PERIOD = 18.0
"""Integration steps per period of an effect's own vibration."""
_CONTACT_STEPS = 80.0
CHUNK = 4
"""Windows that are integrated side by side."""
_FEWEST_FLIGHT_STEPS = 50
"""Fewest steps in a window whose hammer does not vibrate."""
_MOST_IMPACTS = 6
"""Impacts in one window for which steps are reserved, each up to twice as long as expected."""
_OUT_OF_REACH = 1e3
"""Added gap that puts the stop out of reach, m."""
_CLEAR_OF_CONTACT = 8
"""Samples left out before a contact."""
_NEAR = 0.02
"""Distance to the stop, relative to the whole motion, at which contact is possible."""


def integrator_for(prepared: Prepared, *, refinement: float = 1.0) -> AbstractBatchIntegrator:
    """Integrator of a fit: of the exact contact, or Diffrax on the smoothed one where `prepared.smoothing` gives its width.

    `refinement` 2 halves every step, with the same compiled program. The error of the smoothed integrator, which its tolerance sets, falls
    with the eighth power of the step.
    """
    exact = landing_for(prepared, refinement=refinement)
    if prepared.smoothing is None:
        return exact
    from vibrojax.integrate import Smoothed  # imports Diffrax

    usual, finer = Smoothed(prepared.smoothing), refinement**-8.0
    return Smoothed(
        smoothing=jnp.asarray(prepared.smoothing),
        rtol=jnp.asarray(finer * usual.rtol),
        atol=jnp.asarray(finer * usual.atol),
        longest_step=jnp.asarray(exact.flight_step),
    )


def landing_for(prepared: Prepared, *, refinement: float = 1.0) -> Landing:
    """Steps of the exact contact that resolve frequencies and impacts; `refinement` 2 halves every step, with the same compiled program."""
    groups = prepared.groups
    fastest = max([float(group.frequency_hz.max()) for group in groups] + [prepared.model.values().get("f_n", 0.0)])
    flight = float(flight_step(prepared.model.effects, fastest, a_period=_STEPS_PER_PERIOD, an_own_period=_STEPS_PER_OWN_PERIOD))
    longest = max(float((group.ts[:, -1] - group.ts[:, 0]).max()) for group in groups)
    sampling = min(float(np.median(np.diff(group.ts, axis=1), axis=1).min()) for group in groups)
    sampled_input = any(group.motion is not None or group.applied is not None for group in groups)
    flight = min(flight, sampling if sampled_input else np.inf, longest / _FEWEST_FLIGHT_STEPS)
    steps = 2 * (longest / flight + _MOST_IMPACTS * 2 * _CONTACT_STEPS)
    return Landing(
        contact_steps=jnp.asarray(_CONTACT_STEPS * refinement),
        flight_step=jnp.asarray(flight / refinement),
        most_steps=512 * math.ceil(steps / 512),
    )


def evaluator(prepared: Prepared, integrator: AbstractBatchIntegrator, *, side_by_side: int = CHUNK) -> Callable[[Estimate], Equations]:
    """Function from a point of the fit to the normal equations of all windows.

    Windows go through in chunks of one size, which fit the processor's cache, share one compiled program whatever their number, and
    keep all cores busy. `side_by_side` is that size.
    """
    model, layout, count = as_arrays(prepared.model), prepared.layout, len(prepared.record)
    chunks = [(lanes, on_device(group)) for lanes, group in chunked(prepared.groups, side_by_side)]

    def evaluate(estimate: Estimate) -> Equations:
        local = estimate.local(prepared.record)

        def part(chunk: tuple[np.ndarray, Windows]):
            lanes, windows = chunk
            found = normal_equations(model, layout, integrator, windows, jnp.asarray(local[lanes]))
            return jax.tree.map(np.asarray, found)

        hessian, gradient, cost = np.empty((count, layout.size, layout.size)), np.empty((count, layout.size)), np.empty(count)
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            for (lanes, _), found in zip(chunks, threads.map(part, chunks), strict=True):
                hessian[lanes], gradient[lanes], cost[lanes] = found.hessian, found.gradient, found.cost
        lost = ~np.isfinite(cost)
        hessian[lost], gradient[lost] = 0.0, 0.0
        return with_prior(Equations(hessian=hessian, gradient=gradient, cost=cost, record=prepared.record), layout, estimate)

    return evaluate


def fit(
    prepared: Prepared, *, method: LevenbergMarquardt | None = None, progress: Progress = lambda stage, iteration, cost: None
) -> Outcome:
    """Estimate all unknowns from `prepared.start` in stages, which share one compiled program and differ in weights and free parameters."""
    method = method or LevenbergMarquardt()
    integrator = integrator_for(prepared)
    estimate = prepared.start
    in_law = _mask(prepared, {p.name for p in prepared.model.law.parameters})
    whole = free_unknowns(prepared)
    limits = bounds(prepared)
    rough = dataclasses.replace(method, tolerance=10 * method.tolerance, most_iterations=8)

    is_gap = np.array([name == "gap_error" for name in prepared.layout.nuisances])
    flights = prepared.with_groups(flight_only(prepared))
    stages = [
        ("free flight", flights, Active(shared=~in_law & whole.shared, nuisances=whole.nuisances & ~is_gap), rough),
        ("impacts", prepared, Active(shared=in_law & whole.shared, nuisances=whole.nuisances & is_gap), rough),
        ("all", prepared, whole, method),
    ]
    for name, data, active, control in stages:
        if name != "all" and not active.shared.any():
            continue
        evaluate = evaluator(data, integrator)
        if name == "impacts":
            estimate = _best_candidate(prepared, evaluate, estimate, in_law)
        outcome = control(evaluate, estimate, active, limits, lambda i, cost, name=name: progress(name, i, cost))
        estimate = outcome.estimate
    return outcome


def _best_candidate(prepared: Prepared, evaluate: Callable[[Estimate], Equations], estimate: Estimate, in_law: np.ndarray) -> Estimate:
    """The present suspension with the contact law of the first guess that fits the records best, window states fitted.

    Every window is fitted from two initial states, that of its free flight and that read off the record, and keeps the better. After a
    grazing impact, one of them may lead to a motion with one impact too many.
    """
    best, lowest = estimate, np.inf
    for guess in prepared.candidates.values():
        shared = np.where(in_law, guess, estimate.shared)
        flown, flown_costs = settle(evaluate, dataclasses.replace(estimate, shared=shared))
        read, read_costs = settle(evaluate, dataclasses.replace(estimate, shared=shared, states=prepared.start.states))
        better = (read_costs < flown_costs)[:, None]
        total = np.minimum(flown_costs, read_costs).sum()
        if total < lowest:
            best, lowest = dataclasses.replace(flown, states=np.where(better, read.states, flown.states)), total
    return best


def free_unknowns(prepared: Prepared) -> Active:
    """All unknowns that the last stage of the fit estimates."""
    held = _mask(prepared, set(prepared.fixed))
    records, touched = list(prepared.experiment.records), touched_records(prepared)
    return Active(shared=~held, nuisances=free_nuisances(records, prepared.layout, any_contact=touched))


def flight_only(prepared: Prepared) -> tuple[Windows, ...]:
    """The windows up to their first contact, with the stop out of reach: a linear problem."""
    return tuple(
        dataclasses.replace(group, weight=_before_contact(group, prepared), gap=group.gap + _OUT_OF_REACH) for group in prepared.groups
    )


def _before_contact(group: Windows, prepared: Prepared) -> np.ndarray:
    """Weights that are zero from shortly before the first possible contact on; a grazing impact may be too weak for detection."""
    weight = group.weight.copy()
    for lane, (record, first, length) in enumerate(zip(group.record, group.first, group.lengths, strict=True)):
        motion = prepared.motions[record]
        if motion is None:
            continue
        near = motion.u > prepared.experiment.records[record].gap - _NEAR * np.ptp(motion.u)
        contact = (motion.touching | near)[first : first + length]
        if contact.any():
            weight[lane, max(int(np.argmax(contact)) - _CLEAR_OF_CONTACT, 0) :] = 0.0
    return weight


def touched_records(prepared: Prepared) -> np.ndarray:
    """(records,) bool: the hammer touched the stop or exceeded the gap as set; where the motion is unknown, all but a free decay."""
    records = prepared.experiment.records
    return np.array(
        [
            record.kind != "free-decay" if motion is None else bool(motion.touching.any() or motion.u.max() > record.gap)
            for record, motion in zip(records, prepared.motions, strict=True)
        ]
    )


def _mask(prepared: Prepared, names: set[str]) -> np.ndarray:
    return np.array([p.name in names for p in prepared.layout.parameters], bool)


def bounds(prepared: Prepared) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of every shared parameter in internal coordinates."""
    parameters = prepared.layout.parameters
    low = np.array([p.to_internal(max(p.lower, 1e-300) if p.logarithmic else p.lower) for p in parameters])
    return low, np.array([p.to_internal(p.upper) for p in parameters])


def as_arrays(model: Model) -> Model:
    """The model with array leaves, so that compiled code does not depend on its values."""
    arrays = jax.tree.map(jnp.asarray, eqx.filter(model, eqx.is_inexact_array_like))
    return eqx.combine(arrays, model)


def on_device(group: Windows) -> Windows:
    """The windows as JAX arrays."""
    return jax.tree.map(jnp.asarray, group)
