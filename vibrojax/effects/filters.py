"""Filters of sensors and recorder: of first order, estimated as effects; and Butterworth filters that are known.

Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order.
"""

import dataclasses
import functools
import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float
from scipy.signal import buttap, lp2hp_zpk, lp2lp_zpk

from vibrojax.channel_units import EVERY_CHANNEL, UNITS
from vibrojax.effects.base import UNIT_OF_CHANNEL, AbstractChannelFault, AbstractEffect, Motion, Own, OwnState, Reading, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import parameter
from vibrojax.shapes import Value


def low_passed(
    ts: Float[Array, " time"], values: Float[Array, "time ..."], time_constant: Value, memory: Float[Array, "..."]
) -> Float[Array, "time ..."]:
    """Samples behind a low-pass: r_i = a_i r_(i-1) + (1 - a_i) x_i from r_0 = x_0 + memory on, a_i = exp(-(t_i - t_(i-1)) / tau).

    The memory d = r - x obeys d_i = a_i (d_(i-1) + x_(i-1) - x_i). With tau = 0 there is none, whatever is given, and r = x.
    Beside an analogue filter of the same tau the output comes half a sample early. Differentiable for tau > 0.
    """
    filters = jnp.asarray(time_constant) > 0
    exponent = jnp.where(filters, -jnp.diff(ts) / jnp.where(filters, time_constant, 1.0), -jnp.inf)
    return _followed(exponent, values, values[0] + jnp.where(filters, memory, 0.0))


def _followed(exponent: Float[Array, " later"], values: Float[Array, "time ..."], start: Float[Array, "..."]) -> Float[Array, "time ..."]:
    """l_i = a_i l_(i-1) + (1 - a_i) x_i with a_i = exp(exponent_i), and `start` before them."""

    def follow(before, sample):
        kept, fresh, value = sample
        after = kept * before + fresh * value
        return after, after

    _, later = lax.scan(follow, start, (jnp.exp(exponent), -jnp.expm1(exponent), values[1:]))
    return jnp.concatenate([start[None], later])


_LAG_GRID = (1 / 32, 1 / 16, 1 / 8, 1 / 4)
"""Of candidates, over the duration of a contact."""


def _lags(scales: ProbeScales) -> list["ForceLag"]:
    """Several time constants, and the delay that the records show."""
    if "impact_force" not in scales.channels or math.isnan(scales.contact_time):
        return []
    recorded = scales.lags.get("impact_force", 0.0)
    lags = [part * scales.contact_time for part in _LAG_GRID] + ([recorded] if recorded > 0 else [])
    return [ForceLag(lag) for lag in lags]


class ForceLag(AbstractChannelFault):
    """The force channel goes through a low-pass of first order, on its samples.

    r_i = a_i r_(i-1) + (1 - a_i) F_i,   a_i = exp(-(t_i - t_(i-1)) / tau).

    The filter starts with the first sample's force and the decaying response to impacts before that, of time constant tau. Beside
    an analogue filter of the same tau its output comes half a sample early.
    Differentiable for tau > 0.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order.
    """

    name: ClassVar[str] = "force_lag"
    summary: ClassVar[str] = "a force channel that is low-passed or late"
    equation: ClassVar[str] = "r_i = a r_(i-1) + (1 - a) F_i,  a = exp(-dt/tau)"
    source: ClassVar[str] = "Oppenheim and Schafer 1989"
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="memory", unit="N", scale=100.0),)
    probe: ClassVar[Probe] = Probe(_lags)

    of_channel: ClassVar[str] = "impact_force"

    lag: Value = parameter("τ", "s", start=1e-3, lower=1e-7, upper=1.0, meaning="time constant of the low-pass")

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        return low_passed(motion.t, value, self.lag, own[0, 0])


_PIEZOELECTRIC = ("N", "m/s^2")
"""Units of the channels whose sensors are charge or AC coupled."""
_SHORTEST, _LONGEST = 3.0, 3.0
"""Time constants of candidates: from so many contact durations to so many of the longest record."""
_TIME_CONSTANT_RATIO = 3.0
"""From one candidate's time constant to the next, at most."""
_NEVER = 1e12
"""s; a time constant with which nothing discharges."""


def _high_passes(scales: ProbeScales) -> list["SensorHighPass"]:
    """Every cell and accelerometer, over a grid of time constants; without impacts, from a period of the suspension on."""
    longest = _LONGEST * max(last - first for first, last in scales.clock.values())
    shortest = _SHORTEST * scales.contact_time if math.isfinite(scales.contact_time) else 1.0 / scales.f_n if scales.f_n > 0 else longest
    count = 1 + max(math.ceil(math.log(longest / shortest) / math.log(_TIME_CONSTANT_RATIO)), 1)
    constants = np.geomspace(min(shortest, longest), longest, count).tolist()
    return [
        SensorHighPass(time_constant=constant, of_channel=channel)
        for channel in scales.channels
        if UNITS[channel] in _PIEZOELECTRIC
        for constant in constants
    ]


class SensorHighPass(AbstractChannelFault):
    """One channel loses what is slow: its piezoelectric sensor discharges, or its amplifier is AC coupled. A high-pass of first order.

    r_i = a_i (r_(i-1) + x_i - x_(i-1)),   a_i = exp(-(t_i - t_(i-1)) / tau).

    After an impact such a force cell reads below zero, by the impulse over tau. Where nothing is known of what was before the first
    sample, that sample is true: the sensor has just been reset. Differentiable for tau > 0.

    Source: G. Gautschi, Piezoelectric Sensorics (2002), on the time constant of charge amplifiers; filter of first order as in A. V.
    Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989).
    """

    name: ClassVar[str] = "sensor_high_pass"
    summary: ClassVar[str] = "a force cell or accelerometer that is AC coupled or discharges"
    equation: ClassVar[str] = "r_i = a (r_(i-1) + x_i - x_(i-1)),  a = exp(-dt/tau)"
    source: ClassVar[str] = "Gautschi 2002"
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="charge", unit=UNIT_OF_CHANNEL, scale=100.0),)
    probe: ClassVar[Probe] = Probe(_high_passes)

    time_constant: Value = parameter("τ_s", "s", start=1.0, lower=1e-6, upper=1e6, meaning="time constant of the discharge")
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "SensorHighPass":
        """Rate of discharge in proportion: none for a factor of zero."""
        factor = jnp.asarray(factor)
        return dataclasses.replace(
            self, time_constant=jnp.where(factor > 0, self.time_constant / jnp.where(factor > 0, factor, 1.0), _NEVER)
        )

    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        # The memory r - x is what a low-pass of the same tau would show, turned round.
        return value - _followed(-jnp.diff(motion.t) / self.time_constant, value, -own[0, 0])


_CUT_OFF_RATIO = 2.0
"""From one candidate's cut-off to the next."""
_SIZES = {"m": 1e-3, "m/s^2": 10.0, "N": 100.0}
"""Of a filter's memory, by the unit of its channel."""


def _low_passes(scales: ProbeScales) -> list["RecorderLowPass"]:
    """A grid of cut-off frequencies, from somewhat below the suspension's to somewhat below Nyquist's."""
    if not scales.channels:
        return []
    return [
        RecorderLowPass(1.0 / (2.0 * math.pi * cut_off), channels=tuple(scales.channels)) for cut_off in scales.frequencies(_CUT_OFF_RATIO)
    ]


def _memories(effect: "RecorderLowPass") -> tuple[OwnState, ...]:
    """The memory of every channel's filter."""
    return tuple(OwnState(name=channel, unit=UNITS[channel], scale=_SIZES[UNITS[channel]]) for channel in effect.channels)


class RecorderLowPass(AbstractEffect):
    """All channels go through one low-pass of first order, on their samples: the anti-aliasing filter of the recorder.

    r_i = a_i r_(i-1) + (1 - a_i) x_i,   a_i = exp(-(t_i - t_(i-1)) / tau),   in every channel, with the cut-off frequency 1/(2 pi tau).

    Each filter starts with the first sample's value, settled, and the decaying response to what was before that. Beside an analogue
    filter of the same tau its output comes half a sample early. A motion of the cart or an applied force that is measured and drives the
    model is taken as recorded, behind the filter. Differentiable for tau > 0.

    Arguments:
        time_constant: tau, s.
        channels: whose filters' memory is known, or estimated; all by default, those recorded in a fit. Others start settled.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order; anti-aliasing as in
    D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 3.
    """

    name: ClassVar[str] = "recorder_low_pass"
    summary: ClassVar[str] = "a recorder that low-passes all channels alike"
    equation: ClassVar[str] = "r_i = a r_(i-1) + (1 - a) x_i in every channel,  a = exp(-dt/tau)"
    source: ClassVar[str] = "Oppenheim and Schafer 1989"
    own_states: ClassVar[tuple[OwnState, ...]] = property(_memories)  # type: ignore[assignment]
    probe: ClassVar[Probe] = Probe(_low_passes)
    is_fault: ClassVar[bool] = True

    time_constant: Value = parameter("τ_r", "s", start=1e-3, lower=1e-7, upper=1.0, meaning="time constant of the low-pass")
    channels: tuple[str, ...] = eqx.field(static=True, default=EVERY_CHANNEL)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        names = [name for name in EVERY_CHANNEL if name in readings]
        if not names:
            return readings
        known = dict(zip(self.channels, own[0], strict=True))
        memory = jnp.stack([known.get(name, jnp.zeros(())) for name in names])
        filtered = low_passed(motion.t, jnp.stack([readings[name] for name in names], axis=-1), self.time_constant, memory)
        return readings | {name: filtered[:, place] for place, name in enumerate(names)}

    def undone(self, readings: Readings, t: Float[Array, " time"]) -> Readings:
        """x_i = r_i + (r_i - r_(i-1)) a_i / (1 - a_i), settled at the first sample."""
        weight = 1.0 / jnp.expm1(jnp.diff(t) / self.time_constant)
        return {name: values.at[1:].add(weight * jnp.diff(values)) for name, values in readings.items()}

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """The filters', each in the unit of its channel."""
        columns = [shown[name] - readings[name] if name in readings else own[:, place] for place, name in enumerate(self.channels)]
        return jnp.stack(columns, axis=-1)


BANDS = ("lowpass", "highpass")
MOST_ORDER = 8
_SERIES = 24
"""Terms of the series of a phi function, for |z| < 1 exact to rounding."""


def _own_states(effect: "RecorderFilter") -> tuple[OwnState, ...]:
    """The filter's memory: real and imaginary part of each pair of poles, and of a real pole, twice where a pair counts."""
    unit = UNITS[effect.of_channel]
    names = (f"{effect.of_channel} {effect.band} {effect.corner_hz:.9g} Hz {place + 1}" for place in range(effect.order))
    return tuple(OwnState(name=name, unit=unit, scale=_SIZES[unit]) for name in names)


class RecorderFilter(AbstractEffect):
    """One channel behind an analogue Butterworth filter whose order and corner frequency are known.

    H(s) = H(0) + sum_k (c_k / p_k) s / (s - p_k) over the poles p_k with residues c_k, H(0) = 1 of a low-pass and 0 of a high-pass, so that

        r = H(0) x + sum_k e_k,   e_k' = p_k e_k + (c_k / p_k) x',

    integrated exactly from sample to sample for the cubic through the values and rates x' at both. The e_k are the filter's memory, zero
    where the reading has been constant for long. A pause in the samples is one such step: what moved within it is smoothed.
    Nothing of it is estimated and no diagnosis searches for it; the effects `recorder_low_pass` and `sensor_high_pass` are what a fit
    estimates where the filter is not known.

    Arguments:
        of_channel: name of the channel.
        band: "lowpass" or "highpass".
        order: 1 to `MOST_ORDER`.
        corner_hz: frequency at which the amplitude has fallen to 1/sqrt(2), Hz, above 0.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989), appendix B (Butterworth filters), in modal form; phi
    functions as in M. Hochbruck, A. Ostermann, Exponential integrators, Acta Numerica 19 (2010) 209-286.

    Example:
        >>> RecorderFilter("impact_force", "lowpass", 4, 1100.0).kind
        'low-pass (Butterworth, order 4, 1100 Hz)'
    """

    name: ClassVar[str] = "recorder_filter"
    summary: ClassVar[str] = "a known filter of the recorder"
    equation: ClassVar[str] = "r = H(0) x + sum e_k,  e_k' = p_k e_k + (c_k/p_k) x'"
    source: ClassVar[str] = "Oppenheim and Schafer 1989"
    probe: ClassVar[Probe] = Probe(lambda scales: [])
    is_fault: ClassVar[bool] = True
    own_states: ClassVar[tuple[OwnState, ...]] = property(_own_states)  # type: ignore[assignment]

    of_channel: str = eqx.field(static=True)
    band: str = eqx.field(static=True)
    order: int = eqx.field(static=True)
    corner_hz: float = eqx.field(static=True)

    @property
    def kind(self) -> str:
        """What it is, without its channel, for reports."""
        band = {"lowpass": "low-pass", "highpass": "high-pass"}[self.band]
        return f"{band} (Butterworth, order {self.order}, {self.corner_hz:.4g} Hz)"

    @property
    def channel(self) -> str | None:
        return self.of_channel

    def scaled(self, factor: Value) -> "RecorderFilter":
        return self  # it has no strength

    def passed(self, readings: Readings, rates: Readings, ts: Float[Array, " time"], own: Own) -> tuple[Readings, Readings, Own]:
        """Readings and their rates behind the filter, and its memory at every sample.

        Args:
            readings: of all channels, SI.
            rates: their time derivatives.
            ts: of the samples, s.
            own: memory at the first sample, in row 0; (time, order).
        """
        if self.of_channel not in readings:
            return readings, rates, own
        poles, residues, direct = _modes(self.band, self.order, self.corner_hz)
        x, slope = readings[self.of_channel], rates[self.of_channel]
        h = jnp.diff(ts)
        rise, m0, m1 = jnp.diff(x), h * slope[:-1], h * slope[1:]
        parts = jnp.stack([m0, 2.0 * (3.0 * rise - 2.0 * m0 - m1), 6.0 * (m0 + m1 - 2.0 * rise)], axis=-1).astype(complex)
        poles, gain = poles[None], (residues / poles)[None]
        z = h.astype(complex)[:, None] * poles
        driven = gain * sum(part[:, None] * phi for part, phi in zip(parts.T, _phi(z), strict=True))

        def follow(before, step):
            kept, fresh = step
            after = kept * before + fresh
            return after, after

        start = _complex(own[0], self.order)
        _, later = lax.scan(follow, start, (jnp.exp(z), driven))
        memory = jnp.concatenate([start[None], later])
        twice = jnp.where(jnp.imag(poles) > 0.0, 2.0, 1.0)
        shown = direct * x + jnp.sum(twice * memory.real, axis=-1)
        moved = direct * slope + jnp.sum(twice * (poles * memory + gain * slope.astype(complex)[:, None]).real, axis=-1)
        return readings | {self.of_channel: shown}, rates | {self.of_channel: moved}, _real(memory, self.order)


@functools.cache
def _modes(band: str, order: int, corner_hz: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Poles on and above the real axis, 1/s, their residues, and H(0)."""
    turned = lp2lp_zpk if band == "lowpass" else lp2hp_zpk
    found = turned(*buttap(order), wo=2.0 * np.pi * corner_hz)
    zeros, poles = (np.asarray(one, np.complex128) for one in found[:2])
    gain = float(np.real(found[2]))
    upper = np.array([p.real if abs(p.imag) < 1e-9 * abs(p) else p for p in poles if p.imag > -1e-9 * abs(p)], complex)
    upper = upper[np.argsort(np.imag(upper) == 0.0, kind="stable")]  # a real pole last
    others = [np.delete(poles, np.argmin(np.abs(poles - p))) for p in upper]
    residues = np.array([gain * np.prod(p - zeros) / np.prod(p - rest) for p, rest in zip(upper, others, strict=True)])
    return upper, residues, 1.0 if band == "lowpass" else 0.0


def _phi(z: Complex[Array, "steps poles"]) -> list[Complex[Array, "steps poles"]]:
    """phi_k(z) = integral from 0 to 1 of exp(z (1 - s)) s^(k-1) / (k-1)! ds, for k = 1, 2, 3."""
    small = jnp.abs(z) < 1.0
    near, far = jnp.where(small, z, 0.0), jnp.where(small, 1.0, z)
    series = []
    for k in (1, 2, 3):
        term = total = jnp.full_like(near, 1.0 / float(np.prod(np.arange(1, k + 1))))
        for j in range(1, _SERIES):
            term = term * near / (j + k)
            total = total + term
        series.append(total)
    one = jnp.expm1(far) / far
    two = (one - 1.0) / far
    return [jnp.where(small, low, high) for low, high in zip(series, (one, two, (two - 0.5) / far), strict=True)]


def _complex(own: Float[Array, " order"], order: int) -> Complex[Array, " poles"]:
    """The memory by pole: pairs first, as real and imaginary part, then that of a real pole."""
    pairs = own[: order // 2 * 2].reshape(-1, 2)
    found = lax.complex(pairs[:, 0], pairs[:, 1])
    return jnp.concatenate([found, own[-1:].astype(complex)]) if order % 2 else found


def _real(memory: Complex[Array, "time poles"], order: int) -> Own:
    """What `_complex` was made of, at every sample."""
    pairs = memory[:, : order // 2]
    found = jnp.stack([pairs.real, pairs.imag], axis=-1).reshape(memory.shape[0], -1)
    return jnp.concatenate([found, memory[:, -1:].real], axis=-1) if order % 2 else found
