"""The map, and the same map by the switch model."""

import numpy as np

from vibrojax.batch import AbstractEngine, Points, Responses, Sampled, Span, integrate
from vibrojax.contact import HuntCrossley
from vibrojax.integrate import Switch
from vibrojax.model import Model
from vibrojax.studies.classify import PERIODIC, classify
from vibrojax.suspension import Linear

_AMPLITUDE, _F_N = 2e-3, 4.0
_MODEL = Model(mass=0.5, suspension=Linear(0.02, _F_N), law=HuntCrossley(1e6, 1.5, 0.3))


def whole_map(side: int, *, transient: int, closed: float | None = 1e-9, engine: AbstractEngine | None = None) -> Responses:
    """Omega/omega from 0.5 to 5 and gap/A0 from 0 to 3, from rest."""
    return integrate(_MODEL, _points(side), span=Span(transient=transient, closed=closed), engine=engine)


def agreement(side: int, cycles: int) -> dict[str, int | float]:
    """How often both see the same p and q where both see a periodic motion, and what the other points are."""
    frequency = np.asarray(_points(side).values["frequency_hz"])
    runs = (whole_map(side, transient=cycles), whole_map(side, transient=cycles, engine=Sampled(Switch(), samples=400)))
    ours, theirs = (classify(found, _AMPLITUDE, frequency) for found in runs)
    both = (ours.kind == PERIODIC) & (theirs.kind == PERIODIC)
    quiet = (ours.kind == theirs.kind) & (ours.kind != PERIODIC)
    same = both & (ours.impacts == theirs.impacts) & (ours.period == theirs.period)
    return {
        "points": int(both.size),
        "periodic_in_both": int(both.sum()),
        "same_z": int(same.sum()),
        "share": float(same.sum() / max(both.sum(), 1)),
        "same_other_kind": int(quiet.sum()),
        "different_kind": int((ours.kind != theirs.kind).sum()),
    }


def _points(side: int) -> Points:
    ratio, clearance = np.linspace(0.5, 5.0, side), np.linspace(0.0, 3.0, side)
    values = {"frequency_hz": ratio[None, :] * _F_N, "gap": clearance[:, None] * _AMPLITUDE, "base_amplitude": _AMPLITUDE}
    return Points(coords={"clearance": clearance, "ratio": ratio}, values=values)
