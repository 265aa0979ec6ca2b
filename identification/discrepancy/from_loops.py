"""Candidates that begin from what the loops of force against indentation tell, however far that is from the nominal fit."""

import dataclasses

import numpy as np

from identification.discrepancy.look import Scored
from identification.discrepancy.refit import extended
from identification.discrepancy.score import Candidate
from identification.experiment import Record
from identification.fit import free_unknowns
from identification.kinematics import Kinematics
from identification.layout import NUISANCES
from identification.prepare import Prepared
from identification.start.contact import Loops, contact_start
from vibrojax.effects import AbstractEffect, Facts

_BEND = 0.8
"""Cost of a regression of the loops with an effect over that without, up to which they show it."""
_STRAIGHT = 1e-3
"""Cost up to which the law alone describes them."""


def from_loops(scored: Scored) -> list[tuple[Candidate, Prepared]]:
    """Each effect that the loops show, at the strength that they tell, with the windows that begin at law and gaps beside it.

    A law that has been fitted without the effect has bent until no derivative promises anything of it. The loops need no nominal motion.
    """
    seen = _Seen(scored)
    candidates = {one.name: one for one in scored.found if one.members[0].in_loops}
    shown = ((one, seen.shown(one.members[0])) for one in candidates.values())
    return [_begun(scored, one, loops, seen) for one, loops in shown if loops is not None]


class _Seen:
    """The records as the loops are read from them: with the stop where it was touched, however far off the gap was set."""

    def __init__(self, scored: Scored) -> None:
        prepared = scored.fitted.prepared
        self._model, self._motions = scored.fitted.model, list(prepared.motions)
        self._free = tuple(p.name for p in self._model.law.parameters if p.name not in prepared.fixed)
        pairs = list(zip(prepared.experiment.records, prepared.motions, strict=True))
        self._records = [_touched(record, motion) for record, motion in pairs]
        self.shifts = np.array([moved.gap - record.gap for moved, record in zip(self._records, prepared.experiment.records, strict=True)])
        """(records,) from the gap as set to where the stop was touched, m."""
        self.touched = np.array([motion is not None and bool(motion.touching.any()) for motion in prepared.motions])
        """(records,) whether that was seen."""
        self._known = self._as_recorded(scored.known)

    def shown(self, effect: AbstractEffect) -> Loops | None:
        """The loops with the effect, if they show it: by the load cell, or by the hammer's inertia where that tells nothing."""
        probes = tuple(members[0] for members in effect.probes(self._known))
        for load_cell in (True, False) if probes else ():
            straight = self._read(load_cell)
            if straight is not None:
                bent = self._read(load_cell, probes) if straight.cost > _STRAIGHT else None
                return bent if bent is not None and bent.cost <= _BEND * straight.cost else None
        return None

    def _read(self, load_cell: bool, probes: tuple[AbstractEffect, ...] = ()) -> Loops | None:
        return contact_start(self._model, self._records, self._motions, self._free, load_cell=load_cell, probes=probes)

    def _as_recorded(self, known: Facts) -> Facts:
        """What is known before any candidate is tried, with indentation, speed and force as they were recorded."""
        met = [(r, m) for r, m in zip(self._records, self._motions, strict=True) if m is not None and m.touching.any()]
        forces = [motion.inertia if motion.force is None else motion.force for _, motion in met]
        return dataclasses.replace(
            known,
            deepest=max((float(motion.u.max()) - record.gap for record, motion in met), default=0.0),
            speed=max((float(np.abs(motion.v[motion.touching]).max()) for _, motion in met), default=0.0),
            force=max((float(np.nanmax(force)) for force in forces), default=0.0),
        )


def _touched(record: Record, motion: Kinematics | None) -> Record:
    """The record with its gap where contacts begin."""
    if motion is None or not motion.touching.any():
        return record
    begins = motion.touching & ~np.concatenate([[False], motion.touching[:-1]])
    return dataclasses.replace(record, gap=float(np.median(motion.u[begins])))


def _begun(scored: Scored, probe: Candidate, loops: Loops, seen: _Seen) -> tuple[Candidate, Prepared]:
    """The candidate with the numbers of the loops: its own, the law's, and the gaps' where they are estimated."""
    effect = probe.members[0]
    read = dataclasses.replace(effect, **{p.field: loops.values[f"{effect.name}.{p.name}"] for p in effect.parameters})
    candidate = dataclasses.replace(probe, members=(read,), factors=np.ones(1))
    prepared = extended(scored.fitted, candidate, scored.courses)
    shared = prepared.layout.internal(prepared.layout.physical(prepared.start.shared) | loops.values)
    nuisances, column = prepared.start.nuisances.copy(), NUISANCES.index("gap_error")
    told = seen.touched & free_unknowns(prepared).nuisances[:, column]
    nuisances[told, column] = (seen.shifts + loops.errors)[told]
    return candidate, dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=shared, nuisances=nuisances))
