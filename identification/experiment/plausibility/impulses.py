"""How bodies change their speed in the impacts that the load cell shows."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy import stats

from identification.experiment.noise import MAD_TO_STD
from identification.experiment.record import Record
from identification.experiment.settings.scales import MOSTLY_APART

CONTACT = 6.0
"""Standard deviations of the load cell's noise beyond which it feels a contact."""
FEWEST_SAMPLES, FEWEST_IMPACTS = 6, 3
STRUCK = ("drop-test", "cart-excitation")
CHANCE = 1e-4
"""Probability of a slope as large, where there is none, below which it has a sign."""


@dataclass(frozen=True, kw_only=True)
class Response:
    """Change of a body's speed over the impulse of the impacts, by least squares: -1/m for the hammer.

    Attributes:
        slope: 1/kg.
        stderr: from the scatter between the impacts.
        impacts: number of them.
    """

    slope: float
    stderr: float
    impacts: int

    @property
    def sign(self) -> int:
        """1 or -1; 0 where it is not sure."""
        return 0 if abs(self.slope) < stats.t.isf(0.5 * CHANCE, self.impacts - 1) * self.stderr else int(np.sign(self.slope))


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One stretch in which the load cell feels a contact.

    Attributes:
        first: index of its first sample.
        end: index past its last.
        impulse: N s.
    """

    first: int
    end: int
    impulse: float


def impacts_of(record: Record) -> list[Impact]:
    """Every contact that the load cell shows; none without a load cell.

    Args:
        record: with its noise.

    Returns:
        The contacts in order of time; a gap of fewer than `FEWEST_SAMPLES` samples does not part two of them. None where hammer and stop
        are not mostly apart, for then it is not known what the load cell reads at rest.
    """
    force = record.channels.get("impact_force")
    if force is None or "impact_force" not in record.noise:
        return []
    rest = np.nan_to_num(force - np.nanmedian(force))
    inside = np.abs(rest) > CONTACT * record.noise["impact_force"]
    if inside.mean() > MOSTLY_APART:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(np.int8)))
    found: list[tuple[int, int]] = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if found and first - found[-1][1] < FEWEST_SAMPLES:
            found[-1] = (found[-1][0], int(end))
        else:
            found.append((int(first), int(end)))
    return [Impact(first=a, end=b, impulse=float(np.trapezoid(rest[_wider(a, b)], record.time[_wider(a, b)]))) for a, b in found]


def felt_impacts(record: Record) -> list[Impact]:
    """Contacts that the load cell shows, or without one the hammer's accelerometer beside a cart that is at rest or a sine.

    Args:
        record: with its noise.

    Returns:
        As for `impacts_of`; from an accelerometer with impulses over the mass, m/s.
    """
    felt = record.channels.get("hammer_acceleration")
    if "impact_force" in record.channels or felt is None or record.base != "sine" or record.kind not in STRUCK:
        return impacts_of(record)
    rest = np.nan_to_num(np.nanmedian(felt) - felt)
    usual = MAD_TO_STD * float(np.median(np.abs(rest)))
    as_force = replace(record, channels={"impact_force": rest}, noise={"impact_force": usual})
    return impacts_of(as_force) if usual > 0.0 else []


def _wider(first: int, end: int) -> slice:
    """A contact with a sample on either side."""
    return slice(max(first - 1, 0), end + 1)


def response(record: Record, channel: str, impacts: list[Impact]) -> Response | None:
    """How a body's speed answers to the impulses.

    Args:
        record: with the channel.
        channel: a displacement.
        impacts: from `impacts_of`.

    Returns:
        The response; None for fewer than `FEWEST_IMPACTS` impacts with flight on either side.
    """
    changes = list(_changes(record.time, record.channels[channel], impacts))
    if len(changes) < FEWEST_IMPACTS:
        return None
    impulse, change = np.array(changes).T
    slope = float(impulse @ change / (impulse @ impulse))
    scatter = change - slope * impulse
    return Response(slope=slope, stderr=float(np.sqrt(scatter @ scatter / (len(changes) - 1) / (impulse @ impulse))), impacts=len(changes))


def _changes(
    time: Float[np.ndarray, " samples"], values: Float[np.ndarray, " samples"], impacts: list[Impact]
) -> Iterator[tuple[float, float]]:
    """Impulse and change of speed of every contact beside which there is flight of its own length, or `FEWEST_SAMPLES`.

    Beside the contact the motion is a parabola, whose curvature is that of the flight, and its place and slope change in the contact.
    """
    ends = [0, *(impact.end for impact in impacts)]
    begins = [*(impact.first for impact in impacts[1:]), time.size]
    for impact, end, begin in zip(impacts, ends, begins, strict=False):
        reach = max(impact.end - impact.first, FEWEST_SAMPLES)
        before = np.arange(max(impact.first - 1 - reach, end), max(impact.first - 1, 0))
        after = np.arange(impact.end + 1, min(impact.end + 1 + reach, begin))
        both = np.concatenate([before, after])
        if min(before.size, after.size) < FEWEST_SAMPLES or not np.isfinite(values[both]).all():
            continue
        span = float(time[both[-1]] - time[both[0]])
        t = (time[both] - 0.5 * (time[impact.first] + time[impact.end - 1])) / span
        later = (both >= impact.end).astype(float)
        columns = np.stack([np.ones_like(t), t, t**2, later, later * t], axis=1)
        solution, *_ = np.linalg.lstsq(columns, values[both], rcond=None)
        yield impact.impulse, float(solution[4]) / span
