"""Force-indentation loops read from the records, without integration of a motion."""

import dataclasses

import numpy as np

from identification.diagnosis.score.scored import Scored
from identification.experiment import Record
from identification.windows.kinematics import Kinematics
from identification.windows.start.contact import Loops, contact_start
from vibrojax.effects import AbstractEffect, ProbeScales

_CLEAR = 0.8
"""Cost ratio of the loop regressions with and without an effect, up to which the loops show the effect."""
_EXPLAINED = 1e-3
"""Cost of the regression up to which the law alone describes the loops."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shown:
    """Two regressions of the same loops: `without_kink` with the contact law alone, `with_kink` with an effect."""

    without_kink: Loops
    with_kink: Loops


class SeenLoops:
    """Force-indentation loops of all records, with the stop where the records show contact, independent of the gap as set."""

    def __init__(self, scored: Scored) -> None:
        prepared = scored.fitted.prepared
        self._model, self._motions = scored.fitted.model, list(prepared.motions)
        self._free = tuple(p.name for p in self._model.law.parameters if p.name not in prepared.fixed)
        pairs = list(zip(prepared.experiment.records, prepared.motions, strict=True))
        self._records = [_touched(record, motion) for record, motion in pairs]
        self.shifts = np.array([moved.gap - record.gap for moved, record in zip(self._records, prepared.experiment.records, strict=True)])
        """(records,) recorded position of the stop less the gap as set, m."""
        self.touched = np.array([motion is not None and bool(motion.touching.any()) for motion in prepared.motions])
        """(records,) whether the record shows a contact."""
        self._scales = self._as_recorded(scored.scales)

    def shown(self, effect: AbstractEffect) -> Shown | None:
        """Regressions with and without the effect, if the loops show it; from the load cell, or from inertia where that gives no loops."""
        probes = tuple(members[0] for members in effect.probe.candidates(self._scales))
        for load_cell in (True, False) if probes else ():
            without_kink = self._read(load_cell)
            if without_kink is not None:
                with_kink = self._read(load_cell, probes) if without_kink.cost > _EXPLAINED else None
                return (
                    Shown(without_kink=without_kink, with_kink=with_kink)
                    if with_kink is not None and with_kink.cost <= _CLEAR * without_kink.cost
                    else None
                )
        return None

    def _read(self, load_cell: bool, probes: tuple[AbstractEffect, ...] = ()) -> Loops | None:
        return contact_start(self._model, self._records, self._motions, self._free, load_cell=load_cell, probes=probes)

    def _as_recorded(self, scales: ProbeScales) -> ProbeScales:
        """Probe scales with indentation, speed and force as recorded."""
        met = [(r, m) for r, m in zip(self._records, self._motions, strict=True) if m is not None and m.touching.any()]
        forces = [motion.inertia if motion.force is None else motion.force for _, motion in met]
        return dataclasses.replace(
            scales,
            deepest=max((float(motion.u.max()) - record.gap for record, motion in met), default=0.0),
            speed=max((float(np.abs(motion.v[motion.touching]).max()) for _, motion in met), default=0.0),
            force=max((float(np.nanmax(force)) for force in forces), default=0.0),
        )


def _touched(record: Record, motion: Kinematics | None) -> Record:
    """The record with its gap at the median displacement where contacts begin."""
    if motion is None or not motion.touching.any():
        return record
    begins = motion.touching & ~np.concatenate([[False], motion.touching[:-1]])
    return dataclasses.replace(record, gap=float(np.median(motion.u[begins])))
