"""Candidates that begin from what the loops of force against indentation tell, however far that is from the nominal fit."""

import dataclasses
import functools

import numpy as np

from identification.discrepancy.look import Scored
from identification.discrepancy.refit import extended
from identification.discrepancy.score import Candidate
from identification.prepare import Prepared
from identification.start.contact import Loops, contact_start
from vibrojax.effects import AbstractEffect, Facts

_BEND = 0.8
"""Cost of a regression of the loops with an effect over that without, up to which they show it."""
_STRAIGHT = 1e-3
"""Cost up to which the law alone describes them."""


def from_loops(scored: Scored) -> list[tuple[Candidate, Prepared]]:
    """Each effect that the loops show, at the strength that they tell, with the windows that begin at the law beside it.

    A law that has been fitted without the effect has bent until no derivative promises anything of it. The loops need no nominal motion.
    """
    known = _as_recorded(scored)
    shown = ((one, _shown(scored, tuple(members[0] for members in one.members[0].probes(known)))) for one in _candidates(scored))
    return [_begun(scored, one, loops) for one, loops in shown if loops is not None]


def _candidates(scored: Scored) -> list[Candidate]:
    """One probe of each effect that loops may show."""
    return list({one.name: one for one in scored.found if one.members[0].in_loops}.values())


def _as_recorded(scored: Scored) -> Facts:
    """What is known before any candidate is tried, with indentation, speed and force as they were recorded."""
    pairs = [
        (record, motion) for record, motion in zip(scored.fitted.prepared.experiment.records, scored.fitted.prepared.motions, strict=True)
    ]
    met = [(record, motion) for record, motion in pairs if motion is not None and motion.touching.any()]
    forces = [motion.inertia if motion.force is None else motion.force for _, motion in met]
    return dataclasses.replace(
        scored.known,
        deepest=max((float(motion.u.max()) - record.gap for record, motion in met), default=0.0),
        speed=max((float(np.abs(motion.v[motion.touching]).max()) for _, motion in met), default=0.0),
        force=max((float(np.nanmax(force)) for force in forces if force is not None), default=0.0),
    )


def _shown(scored: Scored, probes: tuple[AbstractEffect, ...]) -> Loops | None:
    """The loops with the effect, if they show it: by the load cell, else by the hammer's inertia."""
    prepared, model = scored.fitted.prepared, scored.fitted.model
    names = tuple(p.name for p in model.law.parameters if p.name not in prepared.fixed)
    read = functools.partial(contact_start, model, list(prepared.experiment.records), list(prepared.motions), names)
    load_cell = any(motion is not None and motion.force is not None for motion in prepared.motions)
    straight = read(load_cell=load_cell)
    if straight is None or not probes or straight.cost <= _STRAIGHT:
        return None
    bent = read(load_cell=load_cell, probes=probes)
    return bent if bent is not None and bent.cost <= _BEND * straight.cost else None


def _begun(scored: Scored, probe: Candidate, loops: Loops) -> tuple[Candidate, Prepared]:
    """The candidate with the numbers of the loops, its own and the law's."""
    effect = probe.members[0]
    read = dataclasses.replace(effect, **{p.field: loops.values[f"{effect.name}.{p.name}"] for p in effect.parameters})
    candidate = dataclasses.replace(probe, members=(read,), factors=np.ones(1))
    prepared = extended(scored.fitted, candidate, scored.courses)
    shared = prepared.layout.internal(prepared.layout.physical(prepared.start.shared) | loops.values)
    return candidate, dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=shared))
