"""Faults of a sensor or the recorder at one instant: of gain, characteristic, ceiling or time, tones and a drifting zero."""

import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from vibrojax.channel_units import UNITS
from vibrojax.effects.base import UNIT_OF_CHANNEL, AbstractChannelFault, Motion, Own, Reading, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import parameter
from vibrojax.shapes import Scalars, Value

_CEILING_GRID = (0.9, 0.8, 0.65, 0.5)
"""Of the largest force."""
_OUT_OF_REACH = 1e12
"""N"""


def _ceilings(scales: ProbeScales) -> list["ForceClipping"]:
    """The ceiling that the record shows, or several below the largest force."""
    if "impact_force" not in scales.channels or scales.force == 0:
        return []
    recorded = scales.ceilings.get("impact_force")
    ceilings = [part * scales.force for part in _CEILING_GRID] if recorded is None else [recorded]
    return [ForceClipping(ceiling) for ceiling in ceilings]


class ForceClipping(AbstractChannelFault):
    """The force channel shows nothing above its ceiling.

    r = min(F, ceiling). Differentiable but where F is the ceiling.

    Source: saturation of an amplifier or converter.
    """

    name: ClassVar[str] = "force_clipping"
    summary: ClassVar[str] = "a force channel that saturates"
    equation: ClassVar[str] = "r = min(F, F_max)"
    source: ClassVar[str] = "saturation"
    probe: ClassVar[Probe] = Probe(_ceilings)

    of_channel: ClassVar[str] = "impact_force"

    ceiling: Value = parameter("F_max", "N", start=100.0, lower=1e-6, upper=1e12, meaning="ceiling of the channel")

    def scaled(self, factor: Value) -> "ForceClipping":
        """There, or out of reach for a factor of zero: a ceiling has no strength."""
        return dataclasses.replace(self, ceiling=jnp.where(jnp.asarray(factor) > 0, self.ceiling, _OUT_OF_REACH))

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return jnp.minimum(value, self.ceiling)


class GainError(AbstractChannelFault):
    """One channel shows too much or too little, by a constant factor.

    r = g value. Differentiable everywhere.

    Source: ISO 16063-1, Methods for the calibration of vibration and shock transducers (1998).
    """

    name: ClassVar[str] = "gain_error"
    summary: ClassVar[str] = "a channel whose calibration factor is wrong"
    equation: ClassVar[str] = "r = g value"
    source: ClassVar[str] = "ISO 16063-1"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [GainError(factor=1.01, of_channel=channel) for channel in scales.channels if scales.tied], either_sign=True
    )
    """One hundredth too much, in every channel, where something else sets the size of the motion."""

    factor: Value = parameter("g", "1", start=1.0, scale=0.01, logarithmic=False, meaning="reading over true value")
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "GainError":
        """Distance from one in proportion."""
        return dataclasses.replace(self, factor=1.0 + factor * (self.factor - 1.0))

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return self.factor * value


_PROBE_SHARE = 0.01
"""Of the largest reading, by which each term bends it there."""


def _curves(scales: ProbeScales) -> list["NonlinearReading"]:
    """Square and cube in every channel, each a hundredth of the largest reading."""
    sizes = {channel: scales.largest(channel) for channel in scales.channels}
    return [
        NonlinearReading(quadratic=_PROBE_SHARE / size, cubic=_PROBE_SHARE / size**2, of_channel=channel)
        for channel, size in sizes.items()
        if size > 0
    ]


class NonlinearReading(AbstractChannelFault):
    """One channel has a curved characteristic: a square beside the straight line, a cube, or both.

    r = value + e_2 value^2 + e_3 value^3. Differentiable everywhere.

    Source: E. O. Doebelin, Measurement Systems: Application and Design, 4th edition (1990), chapter 3 (linearity), to the third order.
    """

    name: ClassVar[str] = "nonlinear_reading"
    summary: ClassVar[str] = "a channel with a curved characteristic"
    equation: ClassVar[str] = "r = value + e_2 value^2 + e_3 value^3"
    source: ClassVar[str] = "Doebelin 1990"
    probe: ClassVar[Probe] = Probe(_curves, parts=("quadratic", "cubic"), either_sign=True)

    quadratic: Value = parameter("e_2", f"1/({UNIT_OF_CHANNEL})", start=0.0, lower=-np.inf, meaning="quadratic part of the reading")
    cubic: Value = parameter("e_3", f"1/({UNIT_OF_CHANNEL})^2", start=0.0, lower=-np.inf, meaning="cubic part of the reading")
    of_channel: str = eqx.field(static=True, default="")

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return value + self.quadratic * value * value + self.cubic * value * value * value


_PROBE_DELAY = 0.5
"""Of the shortest sampling interval; of a drifting clock, by the end of the longest record."""
_POINTS = 4
"""Of the interpolation."""


def _offsets(scales: ProbeScales) -> list["TimeOffset"]:
    """Half a sample late, in every channel."""
    return [TimeOffset(delay=_PROBE_DELAY * scales.sampling, of_channel=channel) for channel in scales.channels]


class TimeOffset(AbstractChannelFault):
    """One channel comes late, or early, against the others.

    r(t) = value(t - d), by the cubic through the four samples around; beyond the ends of what was integrated, the outermost
    cubic goes on.
    Differentiable, in d but where t - d is a sample: there the slope of one side.

    Source: T. I. Laakso, V. Valimaki, M. Karjalainen, U. K. Laine, Splitting the unit delay, IEEE Signal Processing Magazine 13 (1996)
    30-60.
    """

    name: ClassVar[str] = "time_offset"
    summary: ClassVar[str] = "a channel that is shifted in time against the others"
    equation: ClassVar[str] = "r(t) = value(t - d)"
    source: ClassVar[str] = "Laakso et al. 1996"
    probe: ClassVar[Probe] = Probe(_offsets, either_sign=True)

    delay: Value = parameter("d", "s", start=0.0, lower=-np.inf, scale=1e-3, meaning="time by which the channel is late")
    of_channel: str = eqx.field(static=True, default="")

    def lateness(self, t: Scalars) -> Scalars:
        return self.delay + jnp.zeros_like(t)

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return _interpolated(motion.t - self.lateness(motion.t), motion.t, value)

    def undone(self, readings: Readings, t: Float[Array, " time"]) -> Readings:
        return _moved_back(readings, self, t)


def _moved_back(readings: Readings, effect: AbstractChannelFault, t: Float[Array, " time"]) -> Readings:
    """Readings with the late channel moved back; beyond the ends of a record its outermost values, since a cubic would carry noise on."""
    late = effect.of_channel
    return readings | ({late: jnp.interp(t + effect.lateness(t), t, readings[late])} if late in readings else {})


def _interpolated(at: Float[Array, " time"], ts: Float[Array, " time"], values: Float[Array, " time"]) -> Float[Array, " time"]:
    """Values at other times, by the cubic through the four samples around each."""
    points = min(_POINTS, ts.shape[0])
    behind = jnp.searchsorted(ts, lax.stop_gradient(at), side="right") - points // 2
    first = jnp.clip(behind, 0, ts.shape[0] - points)
    knots = [ts[first + k] for k in range(points)]
    total = jnp.zeros_like(values)
    for k in range(points):
        weight = jnp.ones_like(values)
        for other in range(points):
            if other != k:
                weight = weight * (at - knots[other]) / (knots[k] - knots[other])
        total = total + weight * values[first + k]
    return total


_PPM = 1e-6


def _clock_drifts(scales: ProbeScales) -> list["ClockDrift"]:
    """Half a sample late by the end of the longest record, in every channel."""
    if scales.latest == 0:
        return []
    drift = _PROBE_DELAY * scales.sampling / scales.latest / _PPM
    return [ClockDrift(drift_ppm=drift, of_channel=channel) for channel in scales.channels]


class ClockDrift(AbstractChannelFault):
    """One channel is recorded by a clock of its own, which runs fast or slow by a constant factor against that of the record.

    r(t) = value(t (1 - ppm 1e-6)), from the zero of the record's clock, where both agree; by the cubic through the four samples around,
    beyond the ends of what was integrated by the outermost one. Differentiable, in ppm but where that is a sample: there the slope of
    one side.

    Source: J. Elson, K. Roemer, Wireless sensor networks: a new regime for time synchronization, ACM SIGCOMM Computer Communication Review
    33 (2003) 149-154 (clock skew); interpolation as in `time_offset`.
    """

    name: ClassVar[str] = "clock_drift"
    summary: ClassVar[str] = "a channel whose clock differs from the others' by a constant factor"
    equation: ClassVar[str] = "r(t) = value(t (1 - ppm 1e-6))"
    source: ClassVar[str] = "Elson and Roemer 2003"
    probe: ClassVar[Probe] = Probe(_clock_drifts, either_sign=True)

    drift_ppm: Value = parameter(
        "ppm", "ppm", start=0.0, lower=-np.inf, scale=100.0, meaning="time that the channel loses, in parts of a million of the record's"
    )
    of_channel: str = eqx.field(static=True, default="")

    def lateness(self, t: Scalars) -> Scalars:
        return _PPM * self.drift_ppm * t

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return _interpolated(motion.t - self.lateness(motion.t), motion.t, value)

    def undone(self, readings: Readings, t: Float[Array, " time"]) -> Readings:
        return _moved_back(readings, self, t)


def _periodic(symbol: str, meaning: str) -> Any:
    """Sine or cosine part of something periodic in one channel; each record has its own."""
    return parameter(symbol, UNIT_OF_CHANNEL, start=0.0, lower=-np.inf, scale=1e-4, per_record=True, meaning=meaning)


def _hums(scales: ProbeScales) -> list["MainsHum"]:
    """Sine and cosine of every line of the mains in the residual of a channel, of the size of its noise."""
    return [
        MainsHum(frequency_hz=line, sine=scales.noise[channel], cosine=scales.noise[channel], of_channel=channel)
        for channel in scales.channels
        for line in scales.foreign_lines(channel)
        if scales.is_of_mains(line)
    ]


class MainsHum(AbstractChannelFault):
    """A line of the mains in one channel, unrelated to the excitation; its phase is another in every record.

    r = value + a sin(2 pi f t) + b cos(2 pi f t), t on the record's clock. Differentiable everywhere.

    Source: G. Vasilescu, Electronic Noise and Interfering Signals (2005).
    """

    name: ClassVar[str] = "mains_hum"
    summary: ClassVar[str] = "an interference line in a channel"
    equation: ClassVar[str] = "r = value + a sin(2 pi f t) + b cos(2 pi f t)"
    source: ClassVar[str] = "Vasilescu 2005"
    probe: ClassVar[Probe] = Probe(_hums, parts=("sine", "cosine"), either_sign=True, is_line=True)

    frequency_hz: Value = parameter("f_h", "Hz", start=50.0, lower=1.0, upper=1e5, meaning="frequency of the line")
    sine: Value = _periodic("a_h", "sine part of the line")
    cosine: Value = _periodic("b_h", "cosine part of the line")
    of_channel: str = eqx.field(static=True, default="")

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        angle = 2.0 * jnp.pi * self.frequency_hz * motion.t
        return value + self.sine * jnp.sin(angle) + self.cosine * jnp.cos(angle)


_DECAYS = (0.0, 3.0)
"""Decay rates of candidates, over the longest record."""


def _tones(scales: ProbeScales) -> list["ReadingTone"]:
    """Sine and cosine of every foreign line in the residual of a channel but the mains', steady and decaying, of the size of its noise."""
    longest = max(last - first for first, last in scales.clock.values())
    return [
        ReadingTone(
            frequency_hz=line, decay_rate=decay / longest, sine=scales.noise[channel], cosine=scales.noise[channel], of_channel=channel
        )
        for channel in scales.channels
        for line in scales.foreign_lines(channel)
        if not scales.is_of_mains(line)
        for decay in _DECAYS
    ]


class ReadingTone(AbstractChannelFault):
    """A steady or decaying tone in one channel, unrelated to the motion of the rig: of a stand, a camera, a floor.

    r = value + exp(-s t) (a sin(2 pi f t) + b cos(2 pi f t)), t on the record's clock; a and b are others in every record.
    Differentiable everywhere.

    Source: the free vibration of a damped oscillator; D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 2.
    """

    name: ClassVar[str] = "reading_tone"
    summary: ClassVar[str] = "a steady or decaying tone in a channel"
    equation: ClassVar[str] = "r = value + exp(-s t) (a sin(2 pi f t) + b cos(2 pi f t))"
    source: ClassVar[str] = "Ewins 2000"
    probe: ClassVar[Probe] = Probe(_tones, parts=("sine", "cosine"), either_sign=True, is_line=True)

    frequency_hz: Value = parameter("f_t", "Hz", start=10.0, lower=1e-3, upper=1e5, meaning="frequency of the tone")
    decay_rate: Value = parameter("s_t", "1/s", start=0.0, logarithmic=False, meaning="decay rate of the tone")
    sine: Value = _periodic("a_t", "sine part of the tone")
    cosine: Value = _periodic("b_t", "cosine part of the tone")
    of_channel: str = eqx.field(static=True, default="")

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        angle = 2.0 * jnp.pi * self.frequency_hz * motion.t
        tone = jnp.exp(-self.decay_rate * motion.t) * (self.sine * jnp.sin(angle) + self.cosine * jnp.cos(angle))
        return value + tone


_WAYS = (0.0, 3.0, 10.0, 30.0)
"""Rates at which a drift of the zero settles in the longest record, times that; 0 for one that does not."""
_NEARLY_STRAIGHT = 1e-4
"""Of kappa t, below which the drift is taken from its series."""


def _drifts(scales: ProbeScales) -> list["ZeroDrift"]:
    """Every channel that can show one, straight and more and more curved, by its noise in the longest record.

    Without a spring that pulls the hammer back, its only displacement cannot: a straight drift is then a steady velocity, which no force
    opposes, and a drift that settles has that as its limit.
    """
    longest = max(last - first for first, last in scales.clock.values())
    displacements = [channel for channel in scales.channels if UNITS[channel] == "m"]
    shown = [channel for channel in scales.channels if scales.f_n > 0.0 or displacements != [channel]]
    return [
        ZeroDrift(rate=scales.noise[channel] / longest, settling_rate=way / longest, of_channel=channel)
        for channel in shown
        for way in _WAYS
    ]


class ZeroDrift(AbstractChannelFault):
    """The zero of one channel drifts while a record lasts, straight on or towards an end, as a sensor or amplifier that warms up.

    r = value + b (1 - exp(-kappa t)) / kappa, and value + b t for kappa = 0, t >= 0 on the record's clock, before which there is no drift;
    b differs between records. Differentiable, but in t at 0.

    Source: E. O. Doebelin, Measurement Systems: Application and Design, 4th edition (1990), chapter 3 (zero drift).
    """

    name: ClassVar[str] = "zero_drift"
    summary: ClassVar[str] = "a channel whose zero drifts"
    equation: ClassVar[str] = "r = value + b (1 - exp(-kappa t)) / kappa"
    source: ClassVar[str] = "Doebelin 1990"
    probe: ClassVar[Probe] = Probe(_drifts, either_sign=True)

    rate: Value = parameter(
        "b_0", f"({UNIT_OF_CHANNEL})/s", start=0.0, lower=-np.inf, scale=1e-4, per_record=True, meaning="rate of the zero at first"
    )
    settling_rate: Value = parameter("κ_0", "1/s", start=0.0, logarithmic=False, meaning="rate at which the zero settles")
    of_channel: str = eqx.field(static=True, default="")

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        since = jnp.maximum(motion.t, 0.0)
        x = self.settling_rate * since
        straight = jnp.abs(x) < _NEARLY_STRAIGHT
        curved = -jnp.expm1(-jnp.where(straight, 1.0, x)) / jnp.where(straight, 1.0, x)
        return value + self.rate * since * jnp.where(straight, 1.0 - x / 2.0 + x * x / 6.0, curved)
