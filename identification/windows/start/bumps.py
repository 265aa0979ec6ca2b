"""Test functions of the weak form: bumps that vanish with their slope at both ends, half overlapping in every flight."""

from functools import cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

_SUPPORTS = (24, 48, 96, 192, 384, 768, 1536)
"""Lengths of the bumps, samples."""
_SEVERAL = 2
"""Shortest flight that shows different parts of the motion, in lengths of the bump: it holds three."""
_CLEAR = 9
"""Samples about a contact that are excluded from the flights."""


def weak_integrals(
    signals: Float[np.ndarray, "signals samples"], touching: Bool[np.ndarray, " samples"], dt: float
) -> dict[int, Float[np.ndarray, "bumps curves signals"]]:
    """Integrals of every signal times phi'', phi' and phi (in this order) over every bump in every flight, by the length of the bumps.

    phi = (1 - s^2)^4, s from -1 to 1. All are divided by the standard deviation of the integral of unit white noise times phi''.

    Args:
        signals: SI, one row each.
        touching: where the hammer meets the stop.
        dt: time step, s.
    """
    found: dict[int, list[np.ndarray]] = {}
    flights = _flights(touching)
    lengths = [length for length in _SUPPORTS if _fits(length, np.array([stop - start for start, stop in flights], int))]
    for start, stop in flights:
        for length in (n for n in lengths if n <= stop - start):
            parts = sliding_window_view(signals[:, start:stop], length, axis=1)[:, :: length // 2]
            found.setdefault(length, []).append((parts @ _curves(length, dt)).transpose(1, 2, 0))
    return {length: np.concatenate(parts) for length, parts in found.items()}


@cache
def _curves(length: int, dt: float) -> Float[np.ndarray, "samples curves"]:
    """phi'', phi' and phi of a bump, weighted."""
    half = 0.5 * (length - 1) * dt
    s = np.linspace(-1, 1, length)
    value, slope, curve = (1 - s**2) ** 4, -8 * s * (1 - s**2) ** 3 / half, (56 * s**2 - 8) * (1 - s**2) ** 2 / half**2
    return np.stack([curve, slope, value], axis=1) / np.sqrt(np.sum(curve**2))


def _fits(length: int, flights: Int[np.ndarray, " flights"]) -> bool:
    """Whether flights that hold several bumps of that length make up most of the time in flight.

    One bump in every flight of a periodic motion is the same equation again and again; and one in a few flights is wrong where these are
    longer than others because an impact was not seen.
    """
    return 2 * int(flights[flights >= _SEVERAL * length].sum()) > int(flights.sum())


def _flights(touching: Bool[np.ndarray, " samples"]) -> list[tuple[int, int]]:
    """Stretches of flight, a few samples clear of contact: (first, one past the last)."""
    near = np.convolve(touching, np.ones(_CLEAR), "same") > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[True], near, [True]]).astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
