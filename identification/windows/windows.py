"""Records cut into windows, each a short initial-value problem of its own (multiple shooting)."""

import dataclasses
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float, Int

from identification.experiment import Record
from identification.windows.kinematics import Kinematics
from vibrojax.channels import EVERY_CHANNEL
from vibrojax.excitation import PiecewiseLinearForce, SampledForce, SampledMotion

Hosted = Any
"""Windows are cut with NumPy and run with JAX: an array of either kind."""
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
    """m, as set."""
    frequency_hz: Float[Hosted, "*lanes"]
    """Excitation frequency as set, Hz; 0 for a cart at rest."""
    motion: SampledMotion | None
    """Measured motion of the cart, with a leading lane axis; None where the cart is at rest or moves harmonically."""
    applied: SampledForce | None
    """Measured force on the hammer, with a leading lane axis; None where there is none."""
    prescribed: SampledMotion | None
    """Motion that the hammer is led along, with a leading lane axis; None where it moves as the forces want."""
    channels: tuple[str, ...] = eqx.field(static=True)
    disturbance: PiecewiseLinearForce | None = None
    """Random force on the hammer, with a leading lane axis; None where it is not estimated."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindowLength:
    """How long a window is."""

    impacts: float = 2.0
    """Impacts in a window, on average: few enough that errors do not grow from impact to impact."""
    fewest: int = 64
    longest: int = 1000
    """Samples."""
    calm: int = 1000
    """Samples of a free decay: without impacts errors do not grow, and what brakes a swing shows over several of its periods."""

    def samples(self, record: Record, motion: Kinematics | None) -> int:
        """Samples of a window of this record."""
        if record.kind == "free-decay":
            return min(max(self.longest, self.calm), len(record.time))
        if motion is None:
            return min(self.longest, len(record.time))
        touches = int(np.sum(np.diff(motion.touching.astype(int)) == 1))
        fair = len(record.time) / max(touches / self.impacts, 1.0)
        return int(np.clip(fair, self.fewest, self.longest))


def cut(record: Record, motion: Kinematics | None, samples: int) -> list[tuple[int, int]]:
    """First sample and length of each window: equal parts whose borders are moved into the middle of a flight."""
    count = max(1, round(len(record.time) / samples))
    borders = np.linspace(0, len(record.time), count + 1).round().astype(int)
    if motion is not None:
        reach = max(1, samples // 4)
        borders[1:-1] = [_quietest(motion.touching, int(border), reach) for border in borders[1:-1]]
    borders = np.unique(borders)
    return [(int(a), int(b - a)) for a, b in zip(borders[:-1], borders[1:], strict=True)]


def _quietest(touching: np.ndarray, border: int, reach: int) -> int:
    """Sample near the border that is furthest from any contact; the border itself if there is no contact near."""
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
