"""Accelerations that the logger computed from a displacement of the same body, and displacements that it computed from an acceleration."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.signal import coherence, welch

from identification.experiment.noise import estimate_noise
from identification.experiment.record import Record

PAIRS = (
    ("hammer_displacement", "hammer_acceleration"),
    ("relative_displacement", "hammer_acceleration"),
    ("cart_displacement", "cart_acceleration"),
)
"""Channels of one motion."""
COMMON = 0.75
"""Coherence of the noise of two channels above which one is computed from the other; two sensors have a coherence near 0."""
FEWEST, SEGMENTS, LONGEST = 512, 16, 256
"""Samples without a gap that are needed; segments of the spectra, at least; their length, at most."""
NEAR_FLOOR = 2.0
"""Power over that of white noise up to which a frequency counts as noise alone."""


def without_derived(records: Sequence[Record]) -> list[Record]:
    """Records without the channels that are computed from another one of the same record, with a notice on each.

    A computed channel is no independent evidence: its noise is that of its source. Of each pair of channels the longest record that holds
    both and was not filtered is judged first, the others only where that one holds a computed channel. A prescribed motion keeps its own.
    """
    found = list(records)
    for pair in PAIRS:
        holding = [index for index, one in enumerate(found) if _is_judged(one, pair)]
        if not holding or _computed(found[max(holding, key=lambda index: found[index].time.size)], pair) is None:
            continue
        for index in holding:
            if (judged := _computed(found[index], pair)) is not None:
                found[index] = _without(found[index], *judged)
    return found


def noise_coherence(one: Float64[np.ndarray, " samples"], other: Float64[np.ndarray, " samples"]) -> tuple[float, tuple[float, float]]:
    """Coherence of two channels where one of them shows noise alone, and the share of the frequencies at which each does.

    Second differences make signals small against the noise. A frequency counts as noise where the power is near that of the white noise
    which the highest differences show (`estimate_noise`). Coherence: J. S. Bendat, A. G. Piersol, Random Data, 4th ed. (2010), ch. 6.

    Args:
        one: any unit, evenly sampled, NaN where not usable.
        other: at the same instants.

    Returns:
        The coherence, 0 to 1, the larger of that in the noise of either; and the two shares. 0 where fewer than `FEWEST` samples without a
        gap are usable in both, or where one shows no noise.
    """
    run = _longest_run(np.isfinite(one) & np.isfinite(other))
    first, second = one[run], other[run]
    noises = [noise for noise in (estimate_noise(first), estimate_noise(second)) if noise is not None]
    if len(first) < FEWEST or len(noises) < 2:
        return 0.0, (0.0, 0.0)
    length = min(LONGEST, len(first) // SEGMENTS)
    frequency, common = coherence(np.diff(first, 2), np.diff(second, 2), nperseg=length)
    means, shares = [], []
    for values, noise in zip((first, second), noises, strict=True):
        power = welch(np.diff(values, 2), nperseg=length)[1]
        noisy = power < NEAR_FLOOR * 2.0 * noise**2 * (2.0 * np.sin(np.pi * frequency)) ** 4
        shares.append(float(noisy.mean()))
        means.append(float(common[noisy].mean()) if noisy.any() else 0.0)
    return max(means), (shares[0], shares[1])


def _longest_run(usable: Bool[np.ndarray, " samples"]) -> slice:
    """The longest stretch of usable samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]]).astype(int))).reshape(-1, 2)
    return slice(*max(edges.tolist(), key=lambda run: run[1] - run[0], default=[0, 0]))


def _is_judged(record: Record, pair: tuple[str, str]) -> bool:
    return record.kind != "prescribed" and not record.sensed and set(pair) <= record.channels.keys()


def _computed(record: Record, pair: tuple[str, str]) -> tuple[str, str, float] | None:
    """Which channel of a pair is computed, its source, whose noise is the whiter one, and the coherence; None where neither is."""
    common, white = noise_coherence(record.channels[pair[0]], record.channels[pair[1]])
    if common <= COMMON:
        return None
    source, computed = pair if white[0] >= white[1] else (pair[1], pair[0])
    return computed, source, common


def _without(record: Record, computed: str, source: str, common: float) -> Record:
    notice = (
        f"{computed}: computed from {source}, whose noise it shares (coherence {common:.2f}); it is not used, because the same measurement "
        "would count twice."
    )
    kept = {name: values for name, values in record.channels.items() if name != computed}
    return replace(record, channels=kept, notices=(*record.notices, notice))
