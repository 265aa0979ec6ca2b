"""A candidate taken into the model: from signals along the motion to physics inside the chain, iterated to the end."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from identification.diagnosis.look import Candidate, Look
from identification.diagnosis.signals import own_states
from identification.trajectory.fit import Fitted, Progress, fit, polished
from identification.trajectory.remodel import remodelled
from identification.trajectory.start import Problem
from identification.trajectory.variances import vanishes
from vibrojax.effects import AbstractEffect
from vibrojax.effects.free_form import FreeForm
from vibrojax.errors import NoConvergenceError


def augmented(seen: Look, candidate: Candidate, strengths: np.ndarray, *, progress: Progress = lambda line: None) -> Fitted:
    """The model with a candidate in it, fitted to the end.

    Args:
        seen: look in which the candidate was found.
        candidate: an effect.
        strengths: of its columns, over the probing strength, from which it starts.
        progress: called with a line in each round.
    """
    return refitted(extended(seen, candidate, strengths), seen.fitted, progress)


def refitted(problem: Problem, beside: Fitted, progress: Progress) -> Fitted:
    """A problem fitted from the variances of the model that it is compared with, and, where a random force stays, anew from both ends.

    A large force at the beginning lets go of what is known of the effect; but reading errors that had taken its place would keep it.
    """
    found = None
    if not beside.of_readings:
        try:
            found = fit(problem, begin=beside.variances, both=False, together=False, progress=progress)
        except NoConvergenceError:
            found = None
        if found is not None and found.converged and vanishes(problem, found.variances.force):
            return found
    anew = fit(problem, together=False, progress=progress)
    anew = polished(anew, progress=progress) if beside.of_readings else anew
    return found if found is not None and found.converged and found.solution.deviance < anew.solution.deviance else anew


def extended(seen: Look, candidate: Candidate, strengths: np.ndarray) -> Problem:
    """The problem with a candidate in the model, at the strengths that it starts from."""
    problem, at = seen.fitted.problem, seen.fitted.at
    effect, own = strengthened(candidate.members, strengths)
    whole = problem.model_at(at)
    model = dataclasses.replace(whole, effects=(*whole.effects, effect))
    return remodelled(problem, at, model, own=own, states=_states(seen, effect))


def learned(seen: Look, candidate: Candidate, strengths: np.ndarray) -> Problem | None:
    """The problem with a free form in the model; None where it is no function of the motion alone, as the stop's path in each record."""
    form = candidate.form
    if form is None or form.quantity == "stop":
        return None
    problem, at = seen.fitted.problem, seen.fitted.at
    knots = np.unique(form.columns[:, 0])
    effect = FreeForm(
        coordinate=form.coordinate,
        knots=tuple(float(form.knots[k]) for k in knots),
        of_channel="" if form.quantity == "force" else form.quantity,
        by_direction=bool((form.columns[:, 1] != 0).any()),
        scales=(form.size,) * len(strengths),
        **{f"c{k}": float(form.size * strength) for k, strength in enumerate(strengths, start=1)},
    )
    whole = problem.model_at(at)
    return remodelled(problem, at, dataclasses.replace(whole, effects=(*whole.effects, effect)))


def without(fitted: Fitted, name: str) -> Problem:
    """The problem without one effect, from the estimate with it."""
    whole = fitted.problem.model_at(fitted.at)
    rest = dataclasses.replace(whole, effects=tuple(effect for effect in whole.effects if effect.name != name))
    return remodelled(fitted.problem, fitted.at, rest)


def strengthened(members: tuple[AbstractEffect, ...], strengths: np.ndarray) -> tuple[AbstractEffect, dict[str, np.ndarray]]:
    """Effect of a candidate at estimated strengths, and its parameters per record by name, (records,) each."""
    own = [p for p in members[0].parameters if p.per_record]
    if own:
        factors = strengths.reshape(len(members), -1)
        values = {f"{members[0].name}.{p.name}": np.array([float(getattr(m, p.field)) for m in members]) @ factors for p in own}
        return dataclasses.replace(members[0], **{p.field: 0.0 for p in own}), values
    scaled = [m.scaled(float(factor)) for m, factor in zip(members, strengths, strict=True)]
    return (scaled[0].probe.joined(scaled) if len(scaled) > 1 else scaled[0]), {}


def _states(seen: Look, effect: AbstractEffect) -> dict[str, np.ndarray]:
    """The effect's own states at the knots, from rest at the start of every record, along the estimated motion."""
    if not effect.own_states:
        return {}
    chains = seen.fitted.problem.chains
    stacked = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64)[None], effect)
    found = np.zeros((chains.knot_count, len(effect.own_states)))
    for knots, course in zip(chains.knots, seen.courses, strict=True):
        own = own_states(stacked, [effect], course)[0]
        kept = np.asarray(effect.memory(course.readings, effect.read(course.readings, course.motion, own), own))
        rows = np.minimum(np.arange(knots.stop - knots.start) * chains.samples, len(kept) - 1)
        found[knots] = kept[rows]
    return {f"{effect.name}.{state.name}": found[:, k] for k, state in enumerate(effect.own_states)}
