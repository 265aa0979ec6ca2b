"""Channels that the logger computed from another one, such as an acceleration differentiated from a displacement."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from jaxtyping import Float64
from scipy.signal import coherence, welch

from identification.experiment.channels import CHANNELS
from identification.experiment.noise import estimate_noise
from identification.experiment.record import Record

COMMON = 0.75
"""Coherence of the noise of two channels above which one is computed from the other; two sensors have a coherence near 0."""
FEWEST, SEGMENTS, LONGEST = 512, 16, 256
"""Samples without which noise cannot be compared; segments of the spectra, at least; their length, at most."""
EDGE = 0.02
"""Cycles a sample, at either end of the spectra, that are left out."""
NEAR_FLOOR = 2.0
"""Power over that of white noise up to which a frequency counts as noise alone."""


def without_derived(records: Sequence[Record]) -> list[Record]:
    """Records without the channels that are computed from another one of the same record, with a notice on each.

    A computed channel is no independent evidence: its noise is that of its source. The longest record that was not filtered decides; a
    record of a prescribed motion keeps all its channels.
    """
    raw = [record for record in records if not record.sensed and record.time.size >= FEWEST]
    if not raw:
        return list(records)
    found = derived(max(raw, key=lambda record: record.time.size))
    return [_without(record, found) if record.kind != "prescribed" else record for record in records]


def derived(record: Record) -> dict[str, tuple[str, float]]:
    """Displacements and accelerations that are computed from another one: their source, and the coherence of their noise.

    Forces are not judged: what a quiet load cell and an accelerometer resolve of the impacts is common to them.
    """
    found: dict[str, tuple[str, float]] = {}
    for one, other in combinations([name for name in record.channels if CHANNELS[name] != "force"], 2):
        common, flat = noise_coherence(record.channels[one], record.channels[other])
        if common > COMMON:  # the noise of the source is the whiter one
            source, computed = (one, other) if flat[0] >= flat[1] else (other, one)
            found.setdefault(computed, (source, common))
    return {name: (source, common) for name, (source, common) in found.items() if source not in found}


def noise_coherence(one: Float64[np.ndarray, " samples"], other: Float64[np.ndarray, " samples"]) -> tuple[float, tuple[float, float]]:
    """Coherence of two channels where one of them shows noise alone, and the share of the frequencies at which each does.

    Second differences make signals small against the noise. A frequency counts as noise where the power is near that of the white noise
    which the highest differences show (`estimate_noise`). Coherence: J. S. Bendat, A. G. Piersol, Random Data, 4th ed. (2010), ch. 6.

    Args:
        one: any unit, evenly sampled, NaN where not usable.
        other: at the same instants.

    Returns:
        The coherence, 0 to 1, the larger of that in the noise of either; and the two shares. 0 where there are too few samples.
    """
    both = np.isfinite(one) & np.isfinite(other)
    if both.sum() < FEWEST:
        return 0.0, (0.0, 0.0)
    first, second = one[both], other[both]
    length = min(LONGEST, len(first) // SEGMENTS)
    frequency, common = coherence(np.diff(first, 2), np.diff(second, 2), nperseg=length)
    inner = (frequency > EDGE) & (frequency < 0.5 - EDGE)
    means, shares = [], []
    for values in (first, second):
        noise = estimate_noise(values)
        power = welch(np.diff(values, 2), nperseg=length)[1]
        white = 2.0 * (noise or 0.0) ** 2 * (2.0 * np.sin(np.pi * frequency)) ** 4
        noisy = inner & (power < NEAR_FLOOR * white)
        shares.append(float(noisy.sum() / inner.sum()))
        means.append(float(common[noisy].mean()) if noisy.any() else 0.0)
    return max(means), (shares[0], shares[1])


def _without(record: Record, found: dict[str, tuple[str, float]]) -> Record:
    gone = {name: one for name, one in found.items() if name in record.channels and one[0] in record.channels}
    said = [
        f"{name}: computed from {source}, with which it shares its noise (coherence {common:.2f}); it is left out, for it counts once."
        for name, (source, common) in gone.items()
    ]
    kept = {name: values for name, values in record.channels.items() if name not in gone}
    return replace(record, channels=kept, notices=(*record.notices, *said)) if gone else record
