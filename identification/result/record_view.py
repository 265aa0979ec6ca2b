"""Quantities of a fitted record for tables and figures: residuals, impacts, measured motion."""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from identification.result.result import RecordFit

_MERGED = 3
"""Samples out of contact that do not separate two impacts."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Impact:
    """One contact of the fitted motion: samples `first` up to and without `end`."""

    first: int
    end: int

    def around(self, samples: int, *, before: float = 1.0, after: float = 1.5) -> slice:
        """Samples from `before` to `after` contact durations about the contact, inside a record of `samples` samples."""
        length = max(self.end - self.first, 8)
        return slice(max(int(self.first - before * length), 0), min(int(self.end + after * length), samples))


def residual(record: RecordFit, channel: str) -> Float[np.ndarray, " samples"]:
    """(measured - model) / noise; NaN where nothing was recorded."""
    return (record.measured[channel] - record.predicted[channel]) / record.noise[channel]


def largest(values: Float[np.ndarray, " samples"]) -> float:
    """Largest magnitude among the finite values; 0 where none is."""
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def impacts(record: RecordFit) -> list[Impact]:
    """Contacts of the fitted motion in order; interruptions of a few samples do not separate them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], record.in_contact, [False]]).astype(int)))
    return merged(Impact(first=int(first), end=int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True))


def merged(parts: Iterable[Impact]) -> list[Impact]:
    """Contacts in order of time; those separated by a few samples at most become one."""
    found: list[Impact] = []
    for one in sorted(parts, key=lambda part: part.first):
        if found and one.first - found[-1].end <= _MERGED:
            found[-1] = dataclasses.replace(found[-1], end=max(one.end, found[-1].end))
        else:
            found.append(one)
    return found


def strength(record: RecordFit, impact: Impact) -> float:
    """Largest force of the fitted law in one impact, N."""
    return largest(record.predicted["impact_force"][impact.first : impact.end])


def misfit(record: RecordFit, impact: Impact) -> float:
    """Mean squared residual of all fitted channels around one impact."""
    part = impact.around(len(record.time), before=0.2, after=0.2)
    squares = [residual(record, channel)[part] ** 2 for channel in record.chi2_reduced]
    usable = np.concatenate(squares) if squares else np.zeros(0)
    usable = usable[np.isfinite(usable)]
    return float(usable.mean()) if len(usable) else 0.0


def notable(record: RecordFit) -> list[Impact]:
    """The strongest and the worst-fitted impact, in order of time; where they are one, also the first or the last."""
    found = impacts(record)
    if not found:
        return []
    chosen = [max(found, key=lambda i: strength(record, i)), max(found, key=lambda i: misfit(record, i)), found[0], found[-1]]
    distinct = list({impact.first: impact for impact in chosen}.values())[:2]
    return sorted(distinct, key=lambda impact: impact.first)


def measured_displacement(record: RecordFit) -> Float[np.ndarray, " samples"] | None:
    """Measured u = x - y, m; the predicted cart replaces one that was not recorded. None without a hammer channel."""
    if "relative_displacement" in record.measured:
        return record.measured["relative_displacement"]
    if "hammer_displacement" not in record.measured:
        return None
    return record.measured["hammer_displacement"] - record.measured.get("cart_displacement", record.predicted["cart_displacement"])
