"""The map that all these benchmarks make."""

import numpy as np

from vibrojax.batch import Points, Responses, Span, integrate
from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Linear

AMPLITUDE, _F_N = 2e-3, 4.0
MODEL = Model(mass=0.5, suspension=Linear(0.02, _F_N), law=HuntCrossley(1e6, 1.5, 0.3))


def whole_map(side: int, *, transient: int, closed: float | None = 1e-9) -> Responses:
    """Omega/omega from 0.5 to 5 and gap/A0 from 0 to 3, from rest."""
    return integrate(MODEL, _points(side), span=Span(transient=transient, closed=closed))


def plane(side: int) -> dict[str, np.ndarray]:
    """Values of gap/A0 and Omega/omega."""
    return {"clearance": np.linspace(0.0, 3.0, side), "ratio": np.linspace(0.5, 5.0, side)}


def _points(side: int) -> Points:
    axes = plane(side)
    frequency, gap = axes["ratio"][None, :] * _F_N, axes["clearance"][:, None] * AMPLITUDE
    return Points(coords=axes, values={"frequency_hz": frequency, "gap": gap, "base_amplitude": AMPLITUDE})
