"""Coefficient of restitution against approach speed, reported where the verdict asserts no cause in the contacts."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import Location, Side
from identification.result.rebounds import Rebound, rebounds
from vibrojax.contact import AbstractInstantaneousLaw

_FEWEST = 6
"""Fewest contacts for a trend over speed."""
_WIDE = 2.0
"""Smallest ratio of fastest to slowest approach speed."""
_OF_ALL, _SOME = 6, 2
"""Slowest and fastest sixth of the contacts form the two ends; fewest contacts of an end."""
_SURE, _FAR = 5.0, 0.02
"""Departure from the model at one end, in standard errors and absolute, above which restitution is reported."""
_VAGUE_POWER = 0.1
"""Standard error above which the exponent of the speed is not reported."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class End:
    """Mean restitution at one end of the speed range: measured, with standard error, and modelled."""

    approach_speed: float
    measured: float
    stderr: float
    fitted: float

    @property
    def departs(self) -> bool:
        """Whether measured and modelled restitution differ significantly and relevantly."""
        return abs(self.measured - self.fitted) > max(_SURE * self.stderr, _FAR)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Restitution:
    """Measured against modelled restitution at the slowest and the fastest impacts.

    Attributes:
        slow, fast: ends of the speed range.
        by_law: whether the hammer is free, so that the comparison involves the contact law alone.
        exponent: b of 1 - e = a v^b and its standard error, from the scatter about that; None where its standard error is large, where
            spring or cart act during a contact, and for a rigid stop, for which no such law is known.
    """

    slow: End
    fast: End
    by_law: bool
    exponent: tuple[float, float] | None


def restitution(side: Side) -> Restitution | None:
    """Restitution at both ends of the speed range; None where it agrees with the model or the speed range is narrow."""
    found = sorted(rebounds(side.records, side.model), key=lambda one: one.approach_speed)
    if len(found) < _FEWEST:
        return None
    count = max(len(found) // _OF_ALL, _SOME)
    slow, fast = _end(found[:count]), _end(found[-count:])
    if fast.approach_speed < _WIDE * slow.approach_speed or not (slow.departs or fast.departs):
        return None
    by_law = found[0].by_law
    exponent = _exponent(found) if by_law and not _is_rigid(side) else None
    return Restitution(slow=slow, fast=fast, by_law=by_law, exponent=exponent)


def lost_in_contacts(location: Location | None, side: Side) -> Restitution | None:
    """Restitution where the misfit is in the contacts only; a misfit elsewhere biases the flights from which restitution is measured.

    Contacts with a rigid stop have no samples to show a misfit; a free hammer's flights are unbiased unless the misfit is in them.
    """
    if location is None or location.phase == "free flight":
        return None
    in_contacts = location.phase == "contact"
    if not in_contacts and not _is_rigid(side):
        return None
    found = restitution(side)
    return found if found is not None and (in_contacts or found.by_law) else None


def _is_rigid(side: Side) -> bool:
    return isinstance(side.model.law, AbstractInstantaneousLaw)


def _end(some: list[Rebound]) -> End:
    """Means over some contacts; the standard error is at least that of their scatter about the model."""
    ratios = [one.restitution for one in some]
    own = np.sqrt(np.sum(np.square([one.stderr for one in some]))) / len(some)
    scatter = np.std([one.restitution - one.fitted for one in some], ddof=1) / np.sqrt(len(some))
    return End(
        approach_speed=float(np.mean([one.approach_speed for one in some])),
        measured=float(np.mean(ratios)),
        stderr=float(max(own, scatter)),
        fitted=float(np.mean([one.fitted for one in some])),
    )


def _exponent(found: list[Rebound]) -> tuple[float, float] | None:
    """Exponent b by least squares of logarithms, from contacts with a significant loss; None where these are few or its error is large."""
    sure = [one for one in found if 1.0 - one.restitution > _SURE * one.stderr]
    if len(sure) < _FEWEST:
        return None
    speeds, lost = np.log([one.approach_speed for one in sure]), np.log([1.0 - one.restitution for one in sure])
    line, covariance = np.polyfit(speeds, lost, 1, cov=True)
    power, stderr = float(line[0]), float(np.sqrt(covariance[0, 0]))
    return (power, stderr) if stderr < _VAGUE_POWER else None
