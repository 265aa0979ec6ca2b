"""How restitution changes with speed, for a verdict that asserts no cause in the contacts."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import Location, Side
from identification.result.rebounds import Rebound, rebounds
from vibrojax.contact import AbstractInstantaneousLaw

_FEWEST = 6
"""Contacts from which a course over the speed is told."""
_WIDE = 2.0
"""Fastest approach over the slowest, likewise."""
_OF_ALL, _SOME = 6, 2
"""One in so many contacts, the slowest and the fastest, is an end; so many at least."""
_SURE, _FAR = 5.0, 0.02
"""What is told departs from the model at one end by so many standard errors, and by so much."""
_VAGUE_POWER = 0.1
"""Standard error from which a power of the speed is not told."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class End:
    """Restitution at one end of the speeds: measured, with its standard error, and as the model has it."""

    approach_speed: float
    measured: float
    stderr: float
    fitted: float

    @property
    def departs(self) -> bool:
        """Whether surely, and not by a trifle."""
        return abs(self.measured - self.fitted) > max(_SURE * self.stderr, _FAR)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Restitution:
    """Its course as the records show it.

    Attributes:
        slow, fast: ends.
        by_law: whether the hammer is free, so that the law alone is compared with it.
        exponent: b of 1 - e = a v^b and its standard error, from the scatter about that; None where it is not known well, where a
            spring or the cart has its part in what happens during a contact, and of a rigid stop, which no such law is known of.
    """

    slow: End
    fast: End
    by_law: bool
    exponent: tuple[float, float] | None


def restitution(side: Side) -> Restitution | None:
    """Where it departs from what the model has; None where that is not sure, or the speeds are all alike."""
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
    """The same where the misfit sits in the contacts, and only there: elsewhere it bends the flights that tell it.

    Contacts with a rigid stop have no samples for it to sit in; a free hammer's flights are straight unless it sits there.
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
    """Means of a few contacts; their standard error is at least that of their scatter about the model."""
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
    """By least squares of logarithms, of what has lost surely; None where little is left or its own error is large."""
    sure = [one for one in found if 1.0 - one.restitution > _SURE * one.stderr]
    if len(sure) < _FEWEST:
        return None
    speeds, lost = np.log([one.approach_speed for one in sure]), np.log([1.0 - one.restitution for one in sure])
    line, covariance = np.polyfit(speeds, lost, 1, cov=True)
    power, stderr = float(line[0]), float(np.sqrt(covariance[0, 0]))
    return (power, stderr) if stderr < _VAGUE_POWER else None
