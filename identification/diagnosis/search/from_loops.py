"""Candidates whose start values come from regressions of the force-indentation loops, independent of the nominal fit."""

import dataclasses

import numpy as np

from identification.diagnosis.refit import extended
from identification.diagnosis.score.force_loops import SeenLoops
from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.scored import Scored
from identification.least_squares.fit import free_unknowns
from identification.windows.layout import GAP_ERROR
from identification.windows.prepare import Prepared
from identification.windows.start.contact import Loops


def from_loops(scored: Scored) -> list[tuple[Candidate, Prepared]]:
    """Candidates with start values from the force-indentation loops, for each effect that the loops show, with their windows.

    The start values of contact law and gaps come from the same regression. A nominal law fitted without the effect may have absorbed it, so
    that the score test is not sensitive to it; the loops need no nominal motion.
    """
    seen = SeenLoops(scored)
    candidates = {one.name: one for one in scored.found if one.members[0].probe.kink}
    shown = ((one, seen.shown(one.members[0])) for one in candidates.values())
    return [_begun(scored, one, loops.with_kink, seen) for one, loops in shown if loops is not None]


def _begun(scored: Scored, probe: Candidate, loops: Loops, seen: SeenLoops) -> tuple[Candidate, Prepared]:
    """The candidate with start values from the loops: those of the effect, of the law, and of the gaps where they are estimated."""
    effect = probe.members[0]
    read = dataclasses.replace(effect, **{p.field: loops.values[f"{effect.name}.{p.name}"] for p in effect.parameters})
    candidate = dataclasses.replace(probe, members=(read,), factors=np.ones(1))
    prepared = extended(scored.fitted, candidate, scored.courses, is_small=False)
    shared = prepared.layout.internal(prepared.layout.physical(prepared.start.shared) | loops.values)
    nuisances, column = prepared.start.nuisances.copy(), GAP_ERROR
    seen_gap = seen.touched & free_unknowns(prepared).nuisances[:, column]
    nuisances[seen_gap, column] = (seen.shifts + loops.errors)[seen_gap]
    return candidate, dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=shared, nuisances=nuisances))
