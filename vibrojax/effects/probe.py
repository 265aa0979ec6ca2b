"""How a diagnosis searches for an effect: its candidates, and what shows it beside the score test.

The physics of an effect (`vibrojax.effects.base`) depends on nothing here but its `probe`.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Generic, TypeVar

import equinox as eqx
import numpy as np

from vibrojax.channel_units import UNITS
from vibrojax.contact import AbstractContactLaw

Kind = TypeVar("Kind", bound=eqx.Module)
"""Class of the effect."""
_SOFTEST = 0.7
"""Lowest frequency of candidates over f_n."""
_FEWEST_CYCLES = 10.0
"""Of a foreign line in a record of middling length: three cycles with phases of their own fit any oscillation."""
_MAINS_HZ = np.array([50.0, 60.0, 100.0, 120.0])
_ON_MAINS = 0.01
"""Relative distance from a frequency of the mains within which a line is theirs, excitation or not."""
_NEAR = 0.02
"""Distance of a line from a multiple of the excitation, or from f_n, relative to that, within which it is taken for it."""


def _near_mains(lines: np.ndarray | float, width: float = 0.0) -> np.ndarray:
    """Whether a line, Hz, or each of several, is within 1 % of a frequency of the mains, or within a width, Hz."""
    off = np.abs(np.asarray(lines)[..., None] - _MAINS_HZ)
    return np.asarray(np.any(off < np.maximum(_ON_MAINS * _MAINS_HZ, width), axis=-1))


@dataclasses.dataclass(frozen=True, kw_only=True)
class ProbeScales:
    """Scales of the records and of the nominal fit, from which candidates take their strengths and grids; SI.

    Attributes:
        mass: of the hammer, kg.
        f_n: natural frequency, Hz; 0 without a spring.
        omega_exc: highest excitation frequency, rad/s; 0 where the cart is at rest.
        drives: all excitation frequencies, rad/s.
        gaps: as set, by record file, m.
        clock: first and last time stamp by record file, s.
        contacts: first and last time stamp of each contact with the stop, s, by record file.
        channels: recorded and fitted ones.
        noise: standard deviation by channel.
        amplitude: largest |u|, m.
        lowest: least u, m.
        speed: largest |u'|, m/s.
        force: largest impact force, N; 0 without impacts.
        deepest: largest indentation, m; 0 without impacts.
        contact_time: of an impact at that speed, s; NaN without impacts, and where the contact law gives them no duration.
        ceilings: saturation level by channel; absent for channels that do not saturate.
        lines: by channel, frequencies of the strongest lines in the residual, Hz, strongest first.
        frequencies_searched: number of frequencies, of all channels, at which lines were looked for.
        lags: by channel, delay against all other channels, found without a model, s, positive where the channel is late; absent where
            it agrees with one of them.
        sampling: shortest interval, s.
        law: the contact law as fitted.
        tied: whether more than the one channel sets the size of the motion: another channel, a known force or motion of the cart, a length,
            impacts at a gap that was set. Otherwise a gain is the unit of length, which these records do not determine.
    """

    mass: float
    f_n: float
    omega_exc: float
    drives: tuple[float, ...]
    gaps: Mapping[str, float]
    clock: Mapping[str, tuple[float, float]]
    contacts: Mapping[str, tuple[tuple[float, float], ...]]
    channels: tuple[str, ...]
    noise: Mapping[str, float]
    amplitude: float
    lowest: float
    speed: float
    force: float
    deepest: float
    contact_time: float
    ceilings: Mapping[str, float]
    lines: Mapping[str, tuple[float, ...]]
    frequencies_searched: int
    lags: Mapping[str, float]
    sampling: float
    law: AbstractContactLaw
    tied: bool

    @property
    def band(self) -> tuple[float, float]:
        """From three periods in the longest record to somewhat below Nyquist's frequency, Hz."""
        return 3.0 / max(last - first for first, last in self.clock.values()), 0.4 / self.sampling

    def frequencies(self, ratio: float, highest: float = math.inf) -> tuple[float, ...]:
        """Geometric grid of frequencies, Hz: at most `ratio` apart, inside `band`, from somewhat below f_n to `highest`.

        A mode much softer than the suspension has next to no effect on the hammer.
        """
        low, high = max(self.band[0], _SOFTEST * self.f_n), min(self.band[1], highest)
        if low > high:
            return ()
        count = 1 + math.ceil(math.log(high / low) / math.log(ratio))
        return tuple(np.geomspace(low, high, count).tolist())

    def foreign_lines(self, channel: str) -> tuple[float, ...]:
        """Strong lines in the residual of a channel, Hz, that are not the motion's own."""
        lines = np.array(self.lines.get(channel, ()))
        return tuple(lines[self.is_foreign(lines)].tolist())

    def is_of_mains(self, lines: np.ndarray | float) -> np.ndarray:
        """Whether a line, Hz, or each of several, is one of the mains, as far as the longest record resolves it."""
        return _near_mains(lines, 1.0 / max(last - first for first, last in self.clock.values()))

    def is_foreign(self, lines: np.ndarray) -> np.ndarray:
        """Whether lines, Hz, last ten cycles, and are those of the mains or not the motion's own.

        That has multiples of the excitation, and f_n, where a tone would be another share of the free motion: so it would be within one
        cycle in the longest record, which does not resolve the two.
        """
        durations = [last - first for first, last in self.clock.values()]
        lowest = _FEWEST_CYCLES / float(np.median(durations))
        of_motion = np.abs(lines - self.f_n) <= max(_NEAR * self.f_n, 1.0 / max(durations))
        for omega in self.drives:
            orders = lines * 2.0 * math.pi / omega
            of_motion |= (orders >= 0.5) & (np.abs(orders - np.round(orders)) <= _NEAR)
        return (lines >= lowest) & (_near_mains(lines) | ~of_motion)

    def largest(self, channel: str) -> float:
        """Size of the largest readings of a channel, in its unit."""
        size = {"m": self.amplitude, "m/s^2": max(self.flight_force, self.force) / self.mass, "N": max(self.flight_force, self.force)}
        return size[UNITS[channel]]

    @property
    def latest(self) -> float:
        """Largest |t| on the clock of any record, s."""
        return max((abs(stamp) for clock in self.clock.values() for stamp in clock), default=0.0)

    @property
    def deflection(self) -> float:
        """Largest deflection of the spring, m; 0 without one: its force then has no shape, no end and no memory."""
        return self.amplitude if self.f_n > 0.0 else 0.0

    @property
    def flight_force(self) -> float:
        """Size of the forces in flight, m v^2 / A of the largest speed and amplitude, N: k A of an oscillator; 0 without motion."""
        return self.mass * self.speed**2 / self.amplitude if self.amplitude > 0 else 0.0


@dataclasses.dataclass(frozen=True)
class Probe(Generic[Kind]):
    """How an effect is searched for.

    The score test estimates a candidate's strength from the derivative along the motion without the effect; what does not enter linearly
    needs a grid of candidates. `is_stop` marks one where that test is not enough.

    Attributes:
        effects: effects at a finite, plausible strength, each a candidate, from the scales of the records; none where it cannot act.
        parts: fields of the strengths that are estimated together (sine and cosine of a line); empty for one strength.
        either_sign: whether a negative strength is possible.
        is_line: whether its candidates are the strongest lines of a spectrum.
        is_stop: whether it is a stop that the motion without it passes through: there the derivative gives no strength.
    """

    effects: Callable[[ProbeScales], Iterable[Kind]]
    _: dataclasses.KW_ONLY
    parts: tuple[str, ...] = ()
    either_sign: bool = False
    is_line: bool = False
    is_stop: bool = False

    def candidates(self, scales: ProbeScales) -> tuple[tuple[Kind, ...], ...]:
        """Candidates, each a tuple of members whose strengths are estimated together: one for each of `parts`, else the effect itself."""
        others = [{field: 0.0 for field in self.parts if field != part} for part in self.parts] or [{}]
        return tuple(tuple(dataclasses.replace(effect, **zero) for zero in others) for effect in self.effects(scales))

    def tried(self, scales: ProbeScales, candidates: int) -> int:
        """Number of possibilities among which the best of so many candidates is chosen, which its significance counts."""
        return candidates + (scales.frequencies_searched if self.is_line else 0)

    def joined(self, members: Sequence[Kind]) -> Kind:
        """One effect with the strengths of all members of a candidate."""
        return dataclasses.replace(members[0], **{field: sum(getattr(one, field) for one in members) for field in self.parts})
