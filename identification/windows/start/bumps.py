"""Test functions of the weak form: bumps that vanish with their slope at both ends, one or several in every flight."""

import dataclasses
from collections.abc import Iterator

import numpy as np

_SUPPORTS = (24, 48, 96, 192, 384, 768, 1536)
"""Lengths of the bumps, samples."""
_CLEAR = 9
"""Samples about a contact that are excluded from the flights."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bump:
    """One test function phi = (1 - s^2)^4, s from -1 to 1, on the samples `part` of a record.

    Attributes:
        part: the samples.
        value: phi, shape (samples,).
        slope: its derivative in time, 1/s.
        curve: its second derivative, 1/s^2.
        weight: one over the standard deviation of an integral of unit white noise with `curve`.
    """

    part: slice
    value: np.ndarray
    slope: np.ndarray
    curve: np.ndarray
    weight: float


def bumps(touching: np.ndarray, dt: float) -> Iterator[Bump]:
    """Bumps of all lengths in every flight, half overlapping; `touching` is where the hammer meets the stop, `dt` the step, s."""
    for start, stop in _flights(touching):
        for length in (n for n in _SUPPORTS if n <= stop - start):
            half = 0.5 * (length - 1) * dt
            s = np.linspace(-1, 1, length)
            value, slope, curve = (1 - s**2) ** 4, -8 * s * (1 - s**2) ** 3 / half, (56 * s**2 - 8) * (1 - s**2) ** 2 / half**2
            weight = float(1.0 / np.sqrt(np.sum(curve**2)))
            for first in range(start, stop - length + 1, length // 2):
                yield Bump(part=slice(first, first + length), value=value, slope=slope, curve=curve, weight=weight)


def _flights(touching: np.ndarray) -> list[tuple[int, int]]:
    """Stretches of flight, a few samples clear of contact: (first, one past the last)."""
    near = np.convolve(touching, np.ones(_CLEAR), "same") > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[True], near, [True]]).astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
