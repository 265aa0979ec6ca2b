"""A chain under another model: effects taken in or left out, parameters that deviate between records; all else stays where it is."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from identification.experiment import Record
from identification.trajectory.chain_equations import Border
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import APPROACH_SPEED, OF_RECORD, VARIATION, Lateness, chains_of
from identification.trajectory.start import Problem, ranges, step_in_flight
from vibrojax.contact import NoContact
from vibrojax.model import Model
from vibrojax.parameters import Parameter


def remodelled(
    problem: Problem,
    at: Estimate,
    model: Model,
    *,
    own: Mapping[str, np.ndarray] = {},
    states: Mapping[str, np.ndarray] = {},
) -> Problem:
    """The problem under a model with other effects, from an estimate under the present one.

    Shared parameters, the records' own numbers and the states that both models have go on from the estimate. What is new starts at the
    model's numbers, and is estimated by maximum likelihood, so that models compare; what a candidate's grid has found is held.

    Args:
        problem: under the present model.
        at: estimate of it.
        model: with other effects, at the strengths from which they start.
        own: first values of the new effects' parameters that every record has for itself, by name; (records,).
        states: first values of the new effects' own states at the knots, by name; (knots,).
    """
    before = problem.unknowns
    values = {name: float(value) for name, value in model.values().items()} | problem.values(at)
    of_effects = {p.name for p in model.parameters} - {p.name for p in problem.model.parameters}
    kept = tuple(p for p in problem.parameters if p.name in values or p.name == "m")
    kept = tuple(p for p in kept if p.name in model.values() or p.name == "m")
    parameters = (*kept, *(_sized(p, values[p.name]) for p in model.parameters if p.name in of_effects))
    per_record = model.record_parameters
    plain = tuple(name for name in before.own if not any(name == p.name for p in problem.model.record_parameters))
    unknowns = dataclasses.replace(
        before,
        shared=tuple((p.name, p.logarithmic) for p in parameters),
        own=(*plain, *(p.name for p in per_record)),
        logarithmic_own=(*(False for _ in plain), *(p.logarithmic for p in per_record)),
        states=(
            "u",
            "v",
            *(f"{effect.name}.{state.name}" for effect in model.acting for state in effect.own_states),
            *((APPROACH_SPEED,) if before.states[-1] == APPROACH_SPEED else ()),
        ),
    )
    shared = np.array([_inside(p, values[p.name]) for p in parameters])
    first = {p.name: np.full(len(at.own), _inside(p, values[p.name])) for p in per_record}
    own_values = first | {name: at.own[:, place] for place, name in enumerate(before.own)} | dict(own)
    knot_values = {name: at.states[:, place] for place, name in enumerate(before.states)} | dict(states)
    acts = _acting(model, problem.experiment.records)
    nothing = np.zeros(len(at.states))
    start = Estimate(
        states=np.stack([knot_values.get(name, nothing) for name in unknowns.states], axis=1),
        force=at.force,
        shared=shared,
        own=np.stack([np.where(acts.get(name, True), own_values[name], 0.0) for name in unknowns.own], axis=1),
    )
    new = tuple(p for p in parameters if p.name in of_effects)
    sizes = dict(zip(before.states[2:], problem.scales.own, strict=True))
    initial = dict(zip(before.states[2:], problem.scales.own_initial, strict=True))
    for effect in model.acting:
        for state in effect.own_states:
            name = f"{effect.name}.{state.name}"
            if name not in sizes:
                sizes[name] = float(np.sqrt(np.mean(knot_values.get(name, nothing) ** 2))) or state.scale or 1.0
                initial[name] = sizes[name]
    fastest = max([values.get("f_n", 0.0)] + [record.excitation_frequency or 0.0 for record in problem.experiment.records])
    step = step_in_flight(problem.experiment.records, model, fastest)
    late = late_channels(model)
    chains = problem.chains
    if late or chains.groups[0].ahead is not None:
        chains = chains_of(problem.experiment.records, chains.samples, rest=problem.rest, late=late)
    return dataclasses.replace(
        problem,
        chains=chains,
        model=model.replace({name: value for name, value in values.items() if name in model.values() or name == "m"}),
        parameters=parameters,
        unknowns=unknowns,
        scales=dataclasses.replace(
            problem.scales,
            own=np.array([sizes[name] for name in unknowns.states[2:]]),
            own_initial=np.array([initial[name] for name in unknowns.states[2:]]),
        ),
        border=_border(problem, model, acts, unknowns.own, new, kept, start),
        integrator=dataclasses.replace(problem.integrator, flight_step=jax.device_put(np.asarray(step))),
        start=start,
    )


def _acting(model: Model, records: Sequence[Record]) -> dict[str, np.ndarray]:
    """Records in which a parameter of an effect that every record has for itself acts, by name: not where its channel is absent."""
    return {
        f"{effect.name}.{p.name}": np.array([effect.channel is None or effect.channel in record.channels for record in records])
        for effect in model.effects
        for p in effect.parameters
        if p.per_record
    }


def late_channels(model: Model) -> dict[str, Lateness]:
    """Time by which channels are late, by channel."""
    return {
        effect.channel: lambda t, effect=effect: np.asarray(effect.lateness(jnp.asarray(t)))
        for effect in model.effects
        if effect.channel and effect.does("lateness")
    }


def _sized(p: Parameter, value: float) -> Parameter:
    """A parameter whose first value is its usual size, the unit of its steps."""
    return p if p.logarithmic or value == 0.0 else dataclasses.replace(p, scale=abs(value))


def _inside(p, value: float) -> float:
    """A value in its range, in the coordinate of the fit."""
    value = float(np.clip(value, max(p.lower, 1e-300) if p.logarithmic else p.lower, p.upper))
    return float(np.log(value)) if p.logarithmic else value


def _border(problem: Problem, model: Model, acts, own_names: tuple[str, ...], new, kept, start: Estimate) -> Border:
    """Free unknowns, scales and priors: as before for what is kept, by its first size for what is new.

    The place of a stop that the nominal model lacks is counted from the gap as set in the record that reaches farthest beyond it; in the
    others, the gap was set with an error.
    """
    border, before = problem.border, problem.unknowns
    places = [before.index(p.name) for p in kept]

    def shared(values: np.ndarray, more) -> np.ndarray:
        return np.concatenate([values[places], np.asarray(more, values.dtype)])

    zeros, (scale, lower, upper) = np.zeros(len(new)), ranges(new)
    records, count = start.own.shape
    own, own_scale = np.ones((records, count), bool), np.ones(count)
    own_mean, own_precision, own_strengths = np.zeros((records, count)), np.zeros((records, count)), np.zeros(count, bool)
    of_effects = {p.name: p for p in model.record_parameters}
    for place, name in enumerate(own_names):
        if name in before.own:
            was = before.own.index(name)
            own[:, place], own_scale[place] = border.own[:, was], border.own_scale[was]
            own_mean[:, place], own_precision[:, place] = border.own_mean[:, was], border.own_precision[:, was]
            own_strengths[place] = border.own_strengths[was]
        else:
            own[:, place] = acts[name]
            own_scale[place] = float(np.abs(start.own[:, place]).max()) or of_effects[name].scale
            own_strengths[place] = True
    if isinstance(model.law, NoContact):
        beyond = [start.states[one, 0].max() - r.gap for one, r in zip(problem.chains.knots, problem.experiment.records, strict=True)]
        own[:, OF_RECORD.index("gap_error")] = model.has_stop & (np.arange(records) != np.argmax(beyond))
    return dataclasses.replace(
        border,
        shared=shared(border.shared, [not p.searched for p in new]),
        own=own,
        shared_scale=shared(border.shared_scale, scale),
        own_scale=own_scale,
        shared_mean=shared(border.shared_mean, start.shared[len(kept) :]),
        shared_precision=shared(border.shared_precision, zeros),
        own_mean=own_mean,
        own_precision=own_precision,
        lower=shared(border.lower, lower),
        upper=shared(border.upper, upper),
        strengths=shared(border.strengths, [True for _ in new]),
        own_strengths=own_strengths,
    )


def with_variation(problem: Problem, std: Mapping[str, float]) -> Problem:
    """A problem in which shared parameters deviate from record to record, with a standard deviation in the coordinate of the fit.

    Where it is 0, the parameter is the same in all records.
    """
    absent = [name for name in std if f"{VARIATION}{name}" not in problem.unknowns.own]
    before, border = problem.unknowns, problem.border
    place = len(before.own) - len(problem.model.record_parameters)

    def widened(values: np.ndarray, value: float | bool) -> np.ndarray:
        return np.insert(values, [place] * len(absent), value, axis=-1)

    own = (*before.own[:place], *(f"{VARIATION}{name}" for name in absent), *before.own[place:])
    logarithmic = (*before.logarithmic_own[:place], *(False for _ in absent), *before.logarithmic_own[place:])
    free, scale, precision = widened(border.own, True), widened(border.own_scale, 1.0), widened(border.own_precision, 1.0)
    for name, size in std.items():
        column = own.index(f"{VARIATION}{name}")
        free[:, column] = size > 0.0
        scale[column], precision[:, column] = (size, size**-2.0) if size > 0.0 else (1.0, 1.0)
    return dataclasses.replace(
        problem,
        unknowns=dataclasses.replace(before, own=own, logarithmic_own=logarithmic),
        border=dataclasses.replace(
            border,
            own=free,
            own_scale=scale,
            own_precision=precision,
            own_mean=widened(border.own_mean, 0.0),
            own_strengths=widened(border.own_strengths, False),
        ),
        start=dataclasses.replace(problem.start, own=widened(problem.start.own, 0.0)),
    )
