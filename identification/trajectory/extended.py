"""Problems with more in them: effects beside the nominal model, and parameters with a value of their own in each record."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from identification.trajectory.chain_equations import Border
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import APPROACH_SPEED, Unknowns, unknowns_of
from identification.trajectory.start import FLIGHT_STEPS, Problem
from vibrojax.effects import AbstractEffect
from vibrojax.integrate.landing import flight_step
from vibrojax.parameters import Parameter

_VARIATION = "variation."


def with_effect(problem: Problem, at: Estimate, effect: AbstractEffect) -> Problem:
    """A problem with one more effect; its shared parameters enter by maximum likelihood, its own states are states of the knots.

    The states begin where those of the problem do, at the measured motion, and at rest those of the effect; the parameters begin at the
    estimate, those of the effect at its numbers.

    Args:
        problem: without the effect.
        at: an estimate of it.
        effect: at the strength to begin with.
    """
    nominal = problem.model_at(at)
    model = dataclasses.replace(nominal, effects=(*nominal.effects, effect))
    new = [p for p in model.parameters if p.name.startswith(f"{effect.name}.")]
    values = {name: float(value) for name, value in model.values().items()}
    parameters = (*problem.parameters, *new)
    names = problem.unknowns.own
    unknowns = unknowns_of(model, parameters, zeros=_after(names, "zero."), varying=_after(names, _VARIATION))
    fastest = max([values.get("f_n", 0.0)] + [record.excitation_frequency or 0.0 for record in problem.experiment.records])
    step = jnp.asarray(flight_step(model.effects, fastest, a_period=FLIGHT_STEPS))
    added = np.array([state.scale for state in effect.own_states])
    place = len(problem.unknowns.states) - 2 - (problem.unknowns.states[-1] == APPROACH_SPEED)
    states = np.insert(problem.start.states, [2 + place] * len(added), 0.0, axis=1)
    shared = np.array([_internal(p, values[p.name]) for p in new])
    border, own = _own_extended(problem, unknowns, model.record_parameters, values)
    return dataclasses.replace(
        problem,
        model=model,
        parameters=parameters,
        unknowns=unknowns,
        border=_shared_extended(border, new, shared),
        scales=dataclasses.replace(problem.scales, own=np.insert(problem.scales.own, [place] * len(added), added)),
        integrator=dataclasses.replace(problem.integrator, flight_step=jnp.minimum(step, problem.integrator.flight_step)),
        start=dataclasses.replace(problem.start, states=states, shared=np.concatenate([at.shared, shared]), own=own),
    )


def with_variation(problem: Problem, std: Mapping[str, float]) -> Problem:
    """A problem in which shared parameters deviate from record to record, with a standard deviation in the coordinate of the fit.

    Where it is 0, the parameter is the same in all records.
    """
    absent = [name for name in std if f"{_VARIATION}{name}" not in problem.unknowns.own]
    if absent:
        zeros, known = _after(problem.unknowns.own, "zero."), _after(problem.unknowns.own, _VARIATION)
        unknowns = unknowns_of(problem.model, problem.parameters, zeros=zeros, varying=(*known, *absent))
        border, own = _own_extended(problem, unknowns, (), {})
        problem = dataclasses.replace(problem, unknowns=unknowns, border=border, start=dataclasses.replace(problem.start, own=own))
    free, scale, precision = problem.border.own.copy(), problem.border.own_scale.copy(), problem.border.own_precision.copy()
    for name, size in std.items():
        place = problem.unknowns.own.index(f"{_VARIATION}{name}")
        free[:, place] = size > 0.0
        scale[place], precision[:, place] = (size, size**-2.0) if size > 0.0 else (1.0, 1.0)
    border = dataclasses.replace(problem.border, own=free, own_scale=scale, own_precision=precision)
    return dataclasses.replace(problem, border=border)


def _after(names: Sequence[str], prefix: str) -> tuple[str, ...]:
    """The rest of the names that begin so."""
    return tuple(name.removeprefix(prefix) for name in names if name.startswith(prefix))


def _internal(p: Parameter, value: float) -> float:
    return float(np.log(max(value, 1e-300))) if p.logarithmic else value


def _shared_extended(border: Border, new: Sequence[Parameter], start: np.ndarray) -> Border:
    """The border with more shared unknowns at its end."""
    more = {
        "shared": [not p.searched for p in new],
        "shared_scale": [1.0 if p.logarithmic else p.scale for p in new],
        "shared_mean": start,
        "shared_precision": np.zeros(len(new)),
        "lower": [_internal(p, p.lower) for p in new],
        "upper": [_internal(p, p.upper) for p in new],
        "strengths": [True] * len(new),
    }
    joined = {name: np.concatenate([getattr(border, name), values]).astype(getattr(border, name).dtype) for name, values in more.items()}
    return dataclasses.replace(border, **joined)


def _own_extended(
    problem: Problem, unknowns: Unknowns, of_effects: Sequence[Parameter], values: Mapping[str, float]
) -> tuple[Border, np.ndarray]:
    """Border and start with the own unknowns in their new order; new ones are free and without prior."""
    before, border, records = list(problem.unknowns.own), problem.border, len(problem.experiment.records)
    listed = {p.name: p for p in of_effects}
    start, free = np.zeros((records, len(unknowns.own))), np.ones((records, len(unknowns.own)), bool)
    scale, mean, precision = np.ones(len(unknowns.own)), np.zeros_like(start), np.zeros_like(start)
    for place, name in enumerate(unknowns.own):
        if name in before:
            old = before.index(name)
            start[:, place], free[:, place], scale[place] = problem.start.own[:, old], border.own[:, old], border.own_scale[old]
            mean[:, place], precision[:, place] = border.own_mean[:, old], border.own_precision[:, old]
        elif name in listed:
            start[:, place] = _internal(listed[name], values[name])
            scale[place] = 1.0 if listed[name].logarithmic else listed[name].scale
    return dataclasses.replace(border, own=free, own_scale=scale, own_mean=mean, own_precision=precision), start
