"""What a learned term adds along the recorded motion, against each coordinate that might decide it."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from identification.diagnosis.diagnosis import Diagnosis
from identification.least_squares.fit import as_arrays
from vibrojax.channels import EVERY_CHANNEL
from vibrojax.compiling import soon_compiled
from vibrojax.effects import AbstractEffect, Motion

Samples = Float[Array, " samples"]
_MOST = 8000
"""Samples that are looked at."""
_BINS = 30
_FEWEST = 50
"""Samples in contact for an indentation to be drawn."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LearnedTerm:
    """The sum of all effects of the augmented model that need no state of their own.

    Attributes:
        channel: that it is added to; None for a force on the hammer.
        value: N or the channel's unit, (samples,).
        coordinates: name and SI unit -> value, NaN where it has no meaning, (samples,); the one that decides most first.
        decided: share of the variance that each of them decides, in the same order.
    """

    channel: str | None
    value: Float[np.ndarray, " samples"]
    coordinates: dict[tuple[str, str], Float[np.ndarray, " samples"]]
    decided: tuple[float, ...]


def learned_term(diagnosis: Diagnosis) -> LearnedTerm | None:
    """The learned term along the records, or None where there is none that the motion alone decides: a sine's phase belongs to a record."""
    if diagnosis.model.record_parameters:
        return None
    effects = tuple(one for one in as_arrays(diagnosis.model).effects if not one.own_states)
    records = diagnosis.augmented.records
    motion = np.concatenate(
        [[r.time, r.relative_displacement, r.relative_velocity, r.relative_displacement - r.gap] for r in records], axis=1
    )
    contact = np.concatenate([r.in_contact for r in records])
    usable = np.flatnonzero(np.isfinite(motion).all(axis=0))
    if not effects or not len(usable):
        return None
    chosen = usable[np.linspace(0, len(usable) - 1, _MOST).round().astype(int)]
    (t, u, v, indentation), touching = motion[:, chosen], contact[chosen]
    parts = _along(effects, *map(jnp.asarray, (t, u, v, indentation, touching)))
    added = {name: np.asarray(values) for name, values in parts.items()}
    channel = max(added, key=lambda name: float(np.ptp(added[name])) / _size(diagnosis, name))
    if np.ptp(added[channel]) == 0.0:
        return None
    found = {("displacement", "m"): u, ("velocity", "m/s"): v, ("time", "s"): t}
    if touching.sum() >= _FEWEST:
        found |= {("indentation", "m"): np.where(touching, indentation, np.nan)}
    value = added[channel]
    shares = {name: _decided(values, value) for name, values in found.items()}
    order = sorted(found, key=lambda name: -shares[name])
    return LearnedTerm(
        channel=None if channel == "force" else channel,
        value=value,
        coordinates={name: found[name] for name in order},
        decided=tuple(shares[name] for name in order),
    )


def _size(diagnosis: Diagnosis, name: str) -> float:
    """What counts as much, to compare a force in N with an addition to a channel in its unit."""
    noises = [record.noise[name] for record in diagnosis.augmented.records if name in record.noise]
    return max(noises, default=1e-3) if name != "force" else 1e-3


def _decided(coordinate: np.ndarray, value: np.ndarray) -> float:
    """Share of the variance that means over bins of the coordinate take up; where it has no meaning, one bin more."""
    known = np.isfinite(coordinate)
    edges = np.unique(np.quantile(coordinate[known], np.linspace(0.0, 1.0, _BINS + 1)))
    bins = np.where(known, np.digitize(np.nan_to_num(coordinate), edges[1:-1]), len(edges))
    counts, sums = np.bincount(bins), np.bincount(bins, weights=value)
    means = sums / np.maximum(counts, 1)
    return 1.0 - float(np.var(value - means[bins])) / max(float(np.var(value)), 1e-300)


@soon_compiled
def _along(
    effects: tuple[AbstractEffect, ...], t: Samples, u: Samples, v: Samples, indentation: Samples, contact: Bool[Array, " samples"]
) -> dict[str, Samples]:
    """Sum of the effects' forces, and of what they add to channels that read nothing."""
    motion = Motion(t=t, u=u, v=v, indentation=indentation, indentation_rate=v, in_contact=contact)
    nothing, silent = jnp.zeros((len(t), 0)), {name: jnp.zeros_like(t) for name in EVERY_CHANNEL}
    found = {"force": jnp.zeros_like(t)} | silent
    for effect in effects:
        found["force"] = found["force"] + effect.force(motion, nothing)
        read = effect.read(silent, motion, nothing)
        found |= {name: found[name] + read[name] for name in silent}
    return found
