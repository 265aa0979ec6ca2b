"""Location of the misfit in one sentence for a test engineer."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import Location, Profile
from identification.wording.numbers import joined


@dataclasses.dataclass(frozen=True, kw_only=True)
class Line:
    """A steady tone in the missing quantity: frequency in Hz, share of the excess."""

    frequency_hz: float
    share: float


_SPOKEN = {
    "hammer_displacement": "the hammer's displacement",
    "cart_displacement": "the cart's displacement",
    "relative_displacement": "the relative displacement",
    "hammer_acceleration": "the hammer's acceleration",
    "cart_acceleration": "the cart's acceleration",
    "impact_force": "the load cell",
}
_PHASES = {
    "all": "runs through the whole motion",
    "free flight": "sits in free flight",
    "contact": "sits in the contacts",
    "separation": "sits where the hammer leaves the stop",
    "after impact": "sits just after impacts",
}
_RANGES = {
    "displacement": "at displacements of {}",
    "velocity": "at velocities of {}",
    "indentation": "at indentations of {}",
    "impact speed": "after impacts at {}",
    "time since impact": "from {} after the hammer touches the stop",
    "excitation phase": "at {} of the excitation period",
    "time": "from {}",
}
_UNITS = {"m": (1e3, " mm"), "m/s": (1e3, " mm/s"), "s": (1e3, " ms"), "rad": (57.29577951308232, "°")}
_ALONE, _QUITE_ALONE, _NAMED, _EVEN = 0.9, 0.99, 0.1, 1.7
"""Shares for "nearly all" and "alone" in a channel; for naming a record; largest share over an equal one that still counts as even."""
_REPORTED = 0.3
"""Share that a profile must explain for its values to be reported."""


def sentence(location: Location, quantity: str, tone: Line | None, *, driven: bool, before_is_quiet: bool) -> str:
    """Sentence with phase, coordinate, records and channel, in this order; an onset in time comes first.

    Arguments:
        location: complete but for its sentence.
        quantity: as in `Profile`.
        tone: steady tone that makes up the misfit, if any.
        driven: whether any record has a drive.
        before_is_quiet: whether the record is fitted to the noise before `location.time`.
    """
    where = _channel(location, quantity)
    if location.time is not None and location.record is not None:
        quiet = "; before it the record agrees within the noise" if before_is_quiet else ""
        return f"The misfit starts at {location.time:.2f} s of {location.record}{quiet}. It {_PHASES[location.phase]}, {where}."
    parts = [_PHASES[location.phase], _along(location, quantity, tone, driven), _records(location.records), where]
    return f"The misfit {', '.join(part for part in parts if part)}."


def _channel(location: Location, quantity: str) -> str:
    """Channel with the largest misfit, or to which it is confined."""
    spoken = _SPOKEN.get(location.channel, location.channel.replace("_", " "))
    if quantity == location.channel and location.channels[location.channel] >= _ALONE:
        alone = location.channels[location.channel] >= _QUITE_ALONE
        if len(location.channels) == 1:
            return f"in {spoken}"
        return f"in {spoken} alone; the other channels agree within the noise" if alone else f"nearly all of it in {spoken}"
    return f"seen most in {spoken}"


def _most(shares: dict[str, float]) -> str:
    """Number of affected records, where none of many stands out."""
    return f"in {sum(share > 0.1 / len(shares) for share in shares.values())} of {len(shares)} records"


def _records(shares: dict[str, float]) -> str:
    """Records with a relevant share of the misfit."""
    fair = 1.0 / len(shares)
    loud = {file: share for file, share in shares.items() if share >= _NAMED * max(1.0, 4.0 * fair)}
    if max(shares.values()) < _EVEN * fair:
        if min(shares.values()) > 0.1 * fair:
            return "in all records"
        return f"in {joined(list(loud))}{' alike' if len(loud) > 1 else ''}" if loud else _most(shares)
    if not loud:
        return _most(shares)
    ranked = sorted(loud.items(), key=lambda item: -item[1])
    shown = joined([f"{100 * share:.0f} %" for _, share in ranked])
    return f"in {joined([file for file, _ in ranked])} ({shown})" if len(ranked) > 1 else f"in {ranked[0][0]}"


def _along(location: Location, quantity: str, tone: Line | None, driven: bool) -> str:
    """Range of the coordinate, and the variation of the missing quantity along it."""
    best = location.profiles[0]
    if tone is not None:
        return f"as a steady tone of {tone.frequency_hz:.1f} Hz" + (" that is no multiple of the drive's frequency" if driven else "")
    extremes = _force(best, location.interval) if quantity == "force" and best.explained >= _REPORTED else ""
    if location.interval is None:
        return f"and changes with the {best.coordinate}{extremes}" if best.coordinate != "time" else "and changes with time"
    factor, unit = _unit(best)
    low, high = (factor * end for end in location.interval)
    if location.coordinate == "velocity" and low < 0 < high and max(-low, high) < 2 * min(-low, high):
        return f"at low speed, |u'| below {_number(max(-low, high))}{unit}{extremes}"
    if location.coordinate == "indentation" and high < 0:
        return f"mostly {_number(-high)} to {_number(-low)}{unit} clear of it{extremes}"
    return "mostly " + _RANGES[location.coordinate].format(f"{_number(low)} to {_number(high)}{unit}") + extremes


def _force(best: Profile, interval: tuple[float, float] | None) -> str:
    """Missing force that exceeds two standard errors: its maximum in an interval, or its extremes along the whole coordinate."""
    factor, unit = _unit(best)
    sure = np.sign(best.mean) * np.maximum(np.abs(best.mean) - 2.0 * best.stderr, 0.0)
    if interval is not None:
        inside = (best.center >= interval[0]) & (best.center <= interval[1])
        largest = best.mean[inside][np.abs(sure[inside]).argmax()] if inside.any() else 0.0
        return f" (missing force up to {_number(abs(largest))} N)" if largest else ""
    low, high = int(sure.argmin()), int(sure.argmax())
    ends = [f"{_number(best.mean[k])} N near {_number(factor * best.center[k])}{unit}" for k in (low, high)]
    return f" (missing force from {ends[0]} to {ends[1]})"


def _unit(best: Profile) -> tuple[float, str]:
    """Display factor and unit of a profile's coordinate."""
    return (1.0, " s") if best.coordinate == "time" else _UNITS.get(best.unit, (1.0, f" {best.unit}"))


def _number(value: float) -> str:
    """Two significant digits."""
    return f"{float(f'{value:.2g}'):g}".replace("-", "−")
