"""Start of a refit: the fitted model extended by a candidate, or reduced by an effect."""

import dataclasses

import numpy as np

from identification.diagnosis.score.profiled import change_of
from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.signature import Course, own_states
from identification.estimation.nominal import if_near, is_near
from identification.least_squares.fit import integrator_for
from identification.least_squares.settling import settled_gradually
from identification.likelihood.fitted import Fitted, first_point
from identification.likelihood.marginal import grams
from identification.likelihood.variances import posterior
from identification.windows.layout import STATES, Estimate, Layout, layout_of
from identification.windows.prepare import Prepared, prepare
from vibrojax.effects import AbstractEffect
from vibrojax.effects.base import OwnState
from vibrojax.model import MASS, Model
from vibrojax.parameters import Parameter

_FAR = 0.7
"""Longest first-order shift of a shared parameter, in its internal coordinate."""
_NO_FORCE = np.zeros((0, 0))
_ROOM = 3.0
"""Prior scale of an effect's own state over its root mean square in the windows."""


def extended(fitted: Fitted, candidate: Candidate, courses: tuple[Course, ...], *, is_small: bool = True) -> Prepared:
    """The fitted model and its windows with one more effect, at the candidate's strength.

    All other unknowns start at their first-order values beside the effect; the random force no longer includes what the effect explains.
    Where the effect is not small (`is_small` false), first order does not hold, and they start unchanged.
    """
    effect, of_records = strengthened(candidate, records=len(courses))
    before, estimate = fitted.prepared, beside(fitted, change_of(fitted, candidate, courses)) if is_small else fitted.estimate
    model = fitted.prepared.model.replace(before.layout.physical(estimate.shared))
    model = dataclasses.replace(model, effects=(*model.effects, effect))
    own = own_states(effect, courses)
    free = [index for index, state in enumerate(effect.own_states) if state.scale > 0]
    first = np.concatenate([group.first for group in before.groups])
    begin = np.array([[own[record][at, index] for index in free] for record, at in zip(before.record, first, strict=True)])
    states = np.concatenate([estimate.states, begin.reshape(len(first), len(free))], axis=1)
    nuisances = np.concatenate([estimate.nuisances, of_records], axis=1)
    return with_model(before, model, nuisances, states, estimate.force)


def beside(fitted: Fitted, change: np.ndarray) -> Estimate:
    """Mode of the linear model's unknowns where `change`, (windows, time, channels), is added to the residual."""
    here = fitted.point
    at = here.without_force()
    inner = grams(dataclasses.replace(at, residual=at.residual + change), here.answer, fitted.variances.noise, here.inner.force)
    found, shared = posterior(here.linear, inner, fitted.variances), len(fitted.estimate.shared)
    step, first = found.step, np.unique(at.record, return_index=True)[1]
    width = fitted.estimate.nuisances.shape[1]
    nuisances = fitted.estimate.nuisances.copy()
    nuisances[at.record[first]] += step[first, shared : shared + width]
    return Estimate(
        shared=_inside(fitted.prepared.layout, fitted.estimate.shared + np.clip(step[0, :shared], -_FAR, _FAR)),
        nuisances=nuisances,
        states=fitted.estimate.states + step[:, shared + width :],
        force=found.force,
    )


def with_model(prepared: Prepared, model: Model, nuisances: np.ndarray, states: np.ndarray, force: np.ndarray = _NO_FORCE) -> Prepared:
    """The same windows under another model, with start values from that model.

    Searched parameters are fixed where they are new; those already set free stay free.
    """
    extra = tuple(p for p in prepared.layout.parameters if p.name == MASS.name)
    values = {name: float(value) for name, value in model.values().items()} | {"m": float(model.mass)}
    of_effects = {f"{effect.name}.{p.name}" for effect in model.effects for p in effect.parameters}
    known = {p.name: p for p in prepared.layout.parameters if p.name not in of_effects}
    was = prepared.layout
    layout = layout_of(model, *extra, files=was.files, zeros=was.zeros, variations=was.variations, priors=was.priors)
    layout = dataclasses.replace(
        layout,
        parameters=tuple(known.get(p.name) or _in_size(p, values[p.name]) for p in layout.parameters),
        own_states=_with_room(layout, states),
    )
    free = {p.name for p in prepared.layout.parameters} - prepared.fixed.keys()
    searched = {p.name: values[p.name] for p in model.parameters if p.searched and p.name not in free}
    shared = layout.internal({p.name: values[p.name] for p in layout.parameters})
    return dataclasses.replace(
        prepared,
        model=model,
        layout=layout,
        fixed=prepared.fixed | searched,
        start=Estimate(shared=_inside(layout, shared), nuisances=nuisances, states=states, force=force),
    )


def without(fitted: Fitted, name: str) -> Prepared:
    """The same windows under the fitted model without one effect and the variations of its parameters, all other values unchanged."""
    before, estimate, whole = fitted.prepared.layout, fitted.estimate, fitted.model
    layout = dataclasses.replace(before, variations=tuple(one for one in before.variations if not one[0].startswith(f"{name}.")))
    model = dataclasses.replace(whole, effects=tuple(effect for effect in whole.effects if effect.name != name))
    names = (*layout.nuisances[: layout.without_effects], *(p.name for p in model.record_parameters))
    kept = [before.nuisances.index(one) for one in names]
    own = [effect.name for effect in whole.effects for state in effect.own_states if state.scale > 0]
    states = len(STATES) + np.flatnonzero([one != name for one in own])
    begin = estimate.states[:, np.concatenate([np.arange(len(STATES)), states])]
    return with_model(dataclasses.replace(fitted.prepared, layout=layout), model, estimate.nuisances[:, kept], begin, estimate.force)


def _in_size(p: Parameter, value: float) -> Parameter:
    """The parameter with a scale not below its value; the scale limits the steps of a fit."""
    if p.logarithmic or not abs(value) > p.scale:
        return p
    return dataclasses.replace(p, scale=10.0 ** np.ceil(np.log10(abs(value))))


def _with_room(layout: Layout, states: np.ndarray) -> tuple[OwnState, ...]:
    """The effects' own states with scales of at least `_ROOM` times their initial rms: the scale is the width of their prior."""
    found = list(layout.own_states)
    for column, index in enumerate(layout.free_own, start=-len(layout.free_own)):
        size = _ROOM * float(np.sqrt(np.mean(states[:, column] ** 2)))
        if size > found[index].scale:
            found[index] = dataclasses.replace(found[index], scale=10.0 ** np.ceil(np.log10(size)))
    return tuple(found)


def strengthened(candidate: Candidate, *, records: int) -> tuple[AbstractEffect, np.ndarray]:
    """Effect of a candidate at its estimated strength, and its parameters per record, (records, parameters)."""
    own = [p for p in candidate.members[0].parameters if p.per_record]
    if own:
        factors = candidate.factors.reshape(len(candidate.members), -1)
        values = [sum(f * float(getattr(m, p.field)) for f, m in zip(factors, candidate.members, strict=True)) for p in own]
        blank = dataclasses.replace(candidate.members[0], **{p.field: 0.0 for p in own})
        return blank, np.stack([np.broadcast_to(v, records) / p.scale for v, p in zip(values, own, strict=True)], axis=1)
    scaled = [m.scaled(float(factor)) for m, factor in zip(candidate.members, candidate.factors, strict=True)]
    return scaled[0].probe.joined(scaled), np.zeros((records, 0))


def _inside(layout: Layout, shared: np.ndarray) -> np.ndarray:
    """Internal coordinates clipped to the range of every parameter."""
    low = np.array([p.to_internal(max(p.lower, 1e-300) if p.logarithmic else p.lower) for p in layout.parameters])
    high = np.array([p.to_internal(p.upper) for p in layout.parameters])
    return np.clip(shared, low, high)


def lengthened(of: Fitted) -> Fitted | None:
    """The model on windows of ordinary length, started from short ones; None if already ordinary, or if the fit is not near the motion."""
    experiment, model = of.prepared.experiment, of.model
    nominal = prepare(experiment, law=model.law.name, most_samples=of.prepared.most_samples)
    if len(nominal.record) >= len(of.prepared.record) or not is_near(of):
        return None
    own = len(of.prepared.layout.free_own)
    states = np.concatenate([nominal.start.states, np.zeros((len(nominal.record), own))], axis=1)
    layout = dataclasses.replace(nominal.layout, variations=of.prepared.layout.variations)
    whole = with_model(dataclasses.replace(nominal, fixed=of.prepared.fixed, layout=layout), model, of.estimate.nuisances, states)
    estimate, cost = settled_gradually(whole, integrator_for(whole))
    return if_near(first_point(whole, estimate)) if np.isfinite(cost).any() else None
