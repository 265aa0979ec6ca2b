"""Where the misfit is, in a sentence that a test engineer understands."""

import dataclasses

from identification.discrepancy.diagnosis import Location, Profile


@dataclasses.dataclass(frozen=True, kw_only=False)
class Line:
    """A steady tone in what is missing: frequency in Hz, share of the excess in it."""

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
_ALONE, _NAMED, _EVEN = 0.9, 0.1, 1.7
"""Share of a channel that is alone; of a record worth naming; largest share of a record over an equal one that is still even."""


def sentence(location: Location, quantity: str, hum: Line | None, *, before_is_quiet: bool) -> str:
    """Phase, coordinate, records and channel, in this order; a beginning in time first of all."""
    where = _channel(location, quantity)
    if location.time is not None and location.record is not None:
        quiet = "; before it the record agrees to the noise" if before_is_quiet else ""
        return f"The misfit starts at {location.time:.2f} s of {location.record}{quiet}; it {_PHASES[location.phase]}, {where}."
    told = f"The misfit {_PHASES[location.phase]}{_along(location, quantity, hum)}, {_records(location.records)}, {where}."
    return told.replace(", ,", ",")


def _channel(location: Location, quantity: str) -> str:
    spoken = _SPOKEN.get(location.channel, location.channel.replace("_", " "))
    if quantity == location.channel and location.channels[location.channel] >= _ALONE:
        return f"in {spoken} alone; the other channels agree to the noise"
    return f"seen most in {spoken}"


def _records(shares: dict[str, float]) -> str:
    """Those with a part worth naming."""
    ranked = sorted(shares.items(), key=lambda item: -item[1])
    if ranked[0][1] < _EVEN / len(ranked):
        return "in all records" if ranked[-1][1] > _NAMED / len(ranked) else f"in {_listed([f for f, s in ranked if s > _NAMED])} alike"
    loud = [(file, share) for file, share in ranked if share >= _NAMED]
    shown = _listed([f"{100 * share:.0f} %" for _, share in loud])
    return f"in {_listed([file for file, _ in loud])} ({shown})"


def _listed(words: list[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


def _along(location: Location, quantity: str, hum: Line | None) -> str:
    """Range of the coordinate, or how what is missing varies along it."""
    if hum is not None:
        return f", as a steady tone of {hum.frequency_hz:.1f} Hz that is no multiple of the drive's frequency"
    best = location.profiles[0]
    if location.interval is None:
        return f", and goes with the {best.coordinate}{_extremes(best, quantity)}"
    factor, unit = _unit(best)
    low, high = (factor * end for end in location.interval)
    if location.coordinate == "velocity" and low < 0 < high and max(-low, high) < 2 * min(-low, high):
        return f" at low speed (below {_number(max(-low, high))} {unit})"
    ends = f"{_number(low)} to {_number(high)} {unit}".strip()
    return (
        f", mostly at {'an ' if best.coordinate[0] in 'aeiou' else 'a '}{best.coordinate} of {ends}"
        if location.coordinate != "time"
        else f", mostly from {ends}"
    )


def _extremes(best: Profile, quantity: str) -> str:
    """Largest and smallest of a profile that explains something."""
    if best.explained < 0.3 or quantity != "force":
        return ""
    factor, unit = _unit(best)
    low, high = int(best.mean.argmin()), int(best.mean.argmax())
    ends = [f"{_number(best.mean[k])} N near {_number(factor * best.center[k])} {unit}" for k in (low, high)]
    return f" (missing force from {ends[0]} to {ends[1]})"


def _unit(best: Profile) -> tuple[float, str]:
    """Factor and unit that read well."""
    if best.unit == "s" and best.coordinate == "time":
        return 1.0, "s"
    return {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "s": (1e3, "ms")}.get(best.unit, (1.0, best.unit))


def _number(value: float) -> str:
    """Two significant digits."""
    return f"{float(f'{value:.2g}'):g}".replace("-", "−")
