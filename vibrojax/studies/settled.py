"""Where the motion from each initial state settles: the part of a study of basins that each initial state has for itself."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from vibrojax.batch import Points, Responses, Span, integrate
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.attractors import SAME
from vibrojax.studies.classify import APERIODIC, LONGEST, Kind, classify
from vibrojax.studies.lyapunov import exponents

STILL = 1e-3
"""m; what sections are measured by where the cart is at rest."""
_GROWS = 2
"""Each time that motions are integrated on, so many times as long as before."""
_SLOWEST = 0.999
"""Closing errors that shrink by less in a period are not extrapolated."""
_KIND, _IMPACTS, _PERIOD = (Kind._fields.index(name) for name in ("kind", "impacts", "period"))
_KEPT = ("u", "v", "impacts", "peak_force", "impact_speed", "u_max", "closed", "cycles", "result")


def settled(
    model: Model, points: Points, *, span: Span | None = None, most_cycles: int | None = None, lyapunov_cycles: int = 200, **options: Any
) -> tuple[Responses, Kind, np.ndarray]:
    """Integrate until each motion repeats, or `most_cycles` are over.

    A motion has settled when its last period repeats the one before to 1e-5 of A0, and what is left of its way, its closing errors summed
    as a geometric series, is less than half of `attractors.SAME`. Motions that have not are integrated on, each time for twice as long: an
    orbit of small damping, and chaos that dies out.

    Arguments:
        model: the rig.
        points: where.
        span: of the first stretch.
        most_cycles: after which a motion that has not settled counts as one that does not; by default ten times the first stretch.
        lyapunov_cycles: over which the exponent of a motion that does not repeat is averaged.
        options: of `vibrojax.batch.integrate`.

    Returns:
        The batch with the last cycles of every motion, its kind, and the Lyapunov exponent per cycle of what does not repeat, else NaN.
    """
    span, values = span or Span(), points.flat()
    most = 10 * (span.transient + span.recorded) if most_cycles is None else most_cycles
    found = integrate(model, _lanes(values, np.arange(points.lanes)), span=span, **options)
    kept = {name: np.array(getattr(found, name)) for name in _KEPT}
    kind, state = [np.array(part) for part in _kind(found, values)], found.state
    after, length = span.transient + span.recorded, span.transient
    while after < most and (left := np.flatnonzero(_open(kept, kind[_PERIOD], values))).size:
        length = min(max(_GROWS * length, 1), most - after)
        further = dataclasses.replace(span, transient=length)
        points_left, begin = _lanes(values, left), jax.tree.map(lambda leaf, left=left: leaf[left], state)
        more = integrate(model, points_left, span=further, start=begin, **options)
        for name, part in kept.items():
            part[left] = getattr(more, name) + (part[left] if name == "cycles" else 0)
        for part, new in zip(kind, _kind(more, points_left.values), strict=True):
            part[left] = new
        state = jax.tree.map(lambda old, new, left=left: old.at[left].set(new), state, more.state)
        after += length + span.recorded
    _shorten(kept, kind, values)
    growth, wild = np.full(points.lanes, np.nan), kind[_KIND] == APERIODIC
    if wild.any() and lyapunov_cycles > 0:
        growth[wild] = exponents(model, points, state, wild, cycles=lyapunov_cycles, threads=options.get("threads"))
    shaped = {name: part.reshape(*points.shape, *part.shape[1:]) for name, part in kept.items()}
    last = Responses(coords=dict(points.coords), state=state, engine=found.engine, seconds=found.seconds, **shaped)
    return last, Kind(*(part.reshape(points.shape) for part in kind)), growth.reshape(points.shape)


def scales(amplitude: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """Sizes by which section points (u, u') are measured: A0 and A0 Omega, the last axis of what comes back."""
    size = np.where(amplitude > 0, amplitude, STILL)
    return np.stack([size, size * 2.0 * np.pi * frequency_hz], axis=-1)


def _lanes(values: Mapping[str, np.ndarray], chosen: np.ndarray) -> Points:
    return Points(coords={"lane": chosen.astype(float)}, values={name: part[chosen] for name, part in values.items()})


def _kind(found: Responses, values: Mapping[str, np.ndarray]) -> Kind:
    return classify(found, values["base_amplitude"], values["frequency_hz"])


def _shorten(kept: Mapping[str, np.ndarray], kind: list[np.ndarray], values: Mapping[str, np.ndarray]) -> None:
    """Give each orbit its shortest period to within `SAME`: a transient that rings at half the drive repeats after two cycles first."""
    points, impacts, full = _scaled(kept, values), kept["impacts"], kind[_PERIOD].copy()
    for q in range(min(LONGEST, points.shape[1] // 2), 1, -1):
        for part in (part for part in range(q - 1, 0, -1) if q % part == 0):
            here = np.flatnonzero(full == q)
            back = slice(-q - part, -part)
            alike = np.abs(points[here, -q:] - points[here, back]).max(axis=(1, 2), initial=0.0) < SAME
            alike &= (impacts[here, -q:] == impacts[here, back]).all(axis=1)
            kind[_IMPACTS][here[alike]] = impacts[here[alike], -part:].sum(axis=1)
            kind[_PERIOD][here[alike]] = part


def _scaled(kept: Mapping[str, np.ndarray], values: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.stack([kept["u"], kept["v"]], axis=-1) / scales(values["base_amplitude"], values["frequency_hz"])[:, None, :]


def _open(kept: Mapping[str, np.ndarray], period: np.ndarray, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which lanes have not settled: no period, or more of the way left than half of `SAME`."""
    points = _scaled(kept, values)
    far = period == 0
    for q in range(1, points.shape[1] // 3 + 1):
        here = period == q
        if here.any():
            steps = np.abs(points[here, q:] - points[here, :-q]).max(axis=2)
            last, before = steps[:, -q:].max(axis=1), steps[:, -2 * q : -q].max(axis=1)
            ratio = np.minimum(last / np.maximum(before, np.finfo(float).tiny), _SLOWEST)
            far[here] = last * ratio / (1.0 - ratio) > 0.5 * SAME
    return far & (kept["closed"] == 0) & (kept["result"] == SUCCESS)
