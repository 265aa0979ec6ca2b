"""Windows of the records: short initial-value problems of multiple shooting."""

import dataclasses
import math
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float, Int

from identification.experiment import Record
from identification.windows.kinematics import Kinematics
from vibrojax.channels import EVERY_CHANNEL
from vibrojax.excitation import PiecewiseLinearForce, SampledForce, SampledMotion

Hosted = Any
"""A NumPy or JAX array: windows are cut with NumPy and integrated with JAX."""
FITTED_CHANNELS = tuple(name for name in EVERY_CHANNEL if name != "applied_force")


class Windows(eqx.Module):
    """All windows that share one kind of excitation, side by side and padded to one length; or, without the lane axis, one of them.

    Lanes are windows. `weight` is 1 / noise where a sample counts and 0 where it was not recorded, not usable or only padding.
    """

    record: Int[Hosted, "*lanes"]
    """Index of the record that each window was cut from."""
    first: Int[Hosted, "*lanes"]
    """Index of the window's first sample in that record."""
    lengths: Int[Hosted, "*lanes"]
    ts: Float[Hosted, "*lanes time"]
    measured: Float[Hosted, "*lanes time channels"]
    weight: Float[Hosted, "*lanes time channels"]
    gap: Float[Hosted, "*lanes"]
    """Gap as set, m."""
    frequency_hz: Float[Hosted, "*lanes"]
    """Excitation frequency as set, Hz; 0 for a cart at rest."""
    motion: SampledMotion | None
    """Measured motion of the cart, with a leading lane axis; None where the cart is at rest or moves harmonically."""
    applied: SampledForce | None
    """Measured force on the hammer, with a leading lane axis; None where there is none."""
    prescribed: SampledMotion | None
    """Prescribed motion of the hammer, with a leading lane axis; None where the hammer moves freely."""
    channels: tuple[str, ...] = eqx.field(static=True)
    disturbance: PiecewiseLinearForce | None = None
    """Random force on the hammer, with a leading lane axis; None where it is not estimated."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindowLength:
    """Target length of a window, in impacts and samples."""

    impacts: float = 2.0
    """Average number of impacts in a window: few enough that errors do not grow from impact to impact."""
    fewest: int = 64
    longest: int = 1000
    """Lower and upper limit, samples."""
    calm: int = 1000
    """Samples of a free decay, and of forced motion without impacts, at least: there errors do not grow."""
    periods: int = 4
    """Periods of such a motion, in up to `most` samples: kinds of damping differ in how the amplitude falls from one to the next."""
    most: int = 4096
    """Limit to that, samples: the memory of a fit is in proportion to the length of a window."""

    def samples(self, record: Record, motion: Kinematics | None) -> int:
        """Length of the windows of this record, samples."""
        flies = motion is not None and not motion.touching.any()
        if record.kind == "free-decay" or (record.kind == "forced" and flies):
            several = 0 if motion is None else min(math.ceil(self.periods * period(motion.u)), self.most)
            return min(max(self.longest, self.calm, several), len(record.time))
        if motion is None:
            return min(self.longest, len(record.time))
        touches = int(np.sum(np.diff(motion.touching.astype(int)) == 1))
        fair = len(record.time) / max(touches / self.impacts, 1.0)
        return int(np.clip(fair, self.fewest, self.longest))


def period(u: Float[np.ndarray, " samples"]) -> float:
    """Mean period of a vibration about its mean, samples; their number where it does not complete one.

    Example:
        >>> period(np.sin(2.0 * np.pi * np.arange(1000) / 125.0 + 0.1))
        125.0
    """
    turns = np.count_nonzero(np.diff(np.signbit(u - u.mean())))
    return 2.0 * len(u) / max(int(turns), 2)


def cut(record: Record, motion: Kinematics | None, samples: int) -> list[tuple[int, int]]:
    """First sample and length of each window: equal parts, with borders moved to the middle of a flight."""
    count = max(1, round(len(record.time) / samples))
    borders = np.linspace(0, len(record.time), count + 1).round().astype(int)
    if motion is not None:
        reach = max(1, samples // 4)
        borders[1:-1] = [_quietest(motion.touching, int(border), reach) for border in borders[1:-1]]
    borders = np.unique(borders)
    return [(int(a), int(b - a)) for a, b in zip(borders[:-1], borders[1:], strict=True)]


def thinned(parts: list[tuple[int, int]], share: float) -> list[tuple[int, int]]:
    """Windows spread evenly over a record: about a share of them, and the first and the last at least.

    Example:
        >>> thinned([(0, 5), (5, 5), (10, 5), (15, 5)], 0.5)
        [(0, 5), (15, 5)]
    """
    if share >= 1.0 or len(parts) == 1:
        return parts
    chosen = np.unique(np.linspace(0, len(parts) - 1, max(2, round(share * len(parts)))).round().astype(int))
    return [parts[index] for index in chosen]


def _quietest(touching: np.ndarray, border: int, reach: int) -> int:
    """Sample near the border with the largest distance from any contact; the border itself if no contact is near."""
    low, high = max(border - reach, 1), min(border + reach, len(touching) - 1)
    contacts = np.flatnonzero(touching[max(low - reach, 0) : high + reach]) + max(low - reach, 0)
    if len(contacts) == 0:
        return border
    candidates = np.arange(low, high)
    after = np.searchsorted(contacts, candidates)
    to_next = np.where(after < len(contacts), contacts[np.minimum(after, len(contacts) - 1)] - candidates, reach)
    to_last = np.where(after > 0, candidates - contacts[np.maximum(after - 1, 0)], reach)
    distance = np.minimum(np.minimum(to_next, to_last), reach)
    best = candidates[distance == distance.max()]
    return int(best[np.argmin(np.abs(best - border))])
