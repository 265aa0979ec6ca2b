"""Where several attractors coexist near an operating point, by a few initial states at each of some gaps and frequencies."""

from typing import NamedTuple

import numpy as np

from vibrojax.batch import Points, Span
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.model import Model
from vibrojax.studies.attractors import Sections, attractors
from vibrojax.studies.settled import scales, settled

_FACTORS = np.geomspace(2.0**-0.5, 2.0**0.5, 21)
_STARTS = 4
"""Initial states along each axis."""
_WIDER = 1.5
"""Times as wide as the picture: attractors may lie beyond it."""


class Place(NamedTuple):
    """A value of one setting, all others kept, at which motions settle differently."""

    setting: str
    """"gap" or "frequency_hz"."""
    value: float
    """SI."""
    names: tuple[str, ...]
    """Of the attractors that were seen."""


def coexistence(
    model: Model,
    *,
    u0: np.ndarray,
    v0: np.ndarray,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
) -> list[Place]:
    """The nearest gap and the nearest frequency, up to the square root of two away, at which periodic attractors are seen to coexist.

    Sixteen initial states around the given ones are integrated at each of 21 gaps (of 21 clearances up to A0 where the gap is 0) and 21
    frequencies. Motions that do not settle do not count.

    Arguments:
        model: the rig.
        u0: m; the ends matter.
        v0: m/s.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        span: how long, at first.
    """
    low, high = (np.array([f(u0), f(v0)]) for f in (np.min, np.max))
    half = _WIDER * 0.5 * (high - low)
    ends = 0.5 * (high + low) - half, 0.5 * (high + low) + half
    starts = np.stack(np.meshgrid(*np.linspace(*ends, _STARTS).T), axis=-1).reshape(-1, 2)
    tried = {"gap": gap * _FACTORS if gap > 0 else base_amplitude * np.linspace(0.05, 1.0, 21), "frequency_hz": frequency_hz * _FACTORS}
    here = {"gap": gap, "frequency_hz": frequency_hz}
    settings = [here | {name: float(value)} for name, values in tried.items() for value in values]
    gaps, frequencies = (np.array([one[name] for one in settings])[:, None] for name in here)
    rigid = isinstance(model.law, AbstractInstantaneousLaw)
    u = np.minimum(starts[None, :, 0], gaps) if rigid else starts[None, :, 0]
    values = {"u0": u, "v0": starts[None, :, 1], "gap": gaps, "frequency_hz": frequencies, "base_amplitude": base_amplitude}
    points = Points(coords={"setting": np.arange(float(len(settings))), "start": np.arange(float(len(starts)))}, values=values)
    found, kind, growth = settled(model, points, span=span, most_cycles=0, lyapunov_cycles=0)
    places = []
    for number, setting in enumerate(settings):
        name = "gap" if number < len(tried["gap"]) else "frequency_hz"
        scale = scales(np.asarray(base_amplitude), np.asarray(setting["frequency_hz"]))
        section = np.stack([found.u[number], found.v[number]], axis=-1) / scale
        _, each = attractors(Sections(section, kind.kind[number], kind.impacts[number], kind.period[number], growth[number]))
        names = tuple(one.name for one in each if one.period > 0)
        if len(names) > 1:
            places.append(Place(name, setting[name], names))
    return [best for name in here if (best := _nearest([place for place in places if place.setting == name], here[name])) is not None]


def _nearest(places: list[Place], here: float) -> Place | None:
    return min(places, key=lambda place: abs(place.value - here)) if places else None
