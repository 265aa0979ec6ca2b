"""A filter of the recorder or of a sensor's amplifier that is known: it acts on what a channel reads, and nothing of it is estimated."""

import functools
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float
from scipy.signal import buttap, lp2hp_zpk, lp2lp_zpk

from vibrojax.channel_units import UNITS
from vibrojax.effects.base import AbstractEffect, Own, OwnState, Readings
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

BANDS = ("lowpass", "highpass")
MOST_ORDER = 8
_SIZES = {"m": 1e-3, "m/s^2": 10.0, "N": 100.0}
"""Of a filter's memory, by the unit of its channel."""
_SERIES = 24
"""Terms of the series of a phi function, for |z| < 1 exact to rounding."""


def _own_states(effect: "RecorderFilter") -> tuple[OwnState, ...]:
    """The filter's memory: real and imaginary part of each pair of poles, and of a real pole, twice where a pair counts."""
    unit = UNITS[effect.of_channel]
    names = (f"{effect.of_channel} {effect.band} {effect.corner_hz:.9g} Hz {place + 1}" for place in range(effect.order))
    return tuple(OwnState(name=name, unit=unit, scale=_SIZES[unit], carried=False) for name in names)


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
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [])
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
    def is_fault(self) -> bool:
        """It belongs to the recorder, of which the rig knows nothing."""
        return True

    @property
    def channel(self) -> str | None:
        """The one that it acts on."""
        return self.of_channel

    def scaled(self, factor: Value) -> "RecorderFilter":
        """As it is: it has no strength."""
        return self

    def rates(self, motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """None: the states are the filter's memory at the first sample."""
        return jnp.zeros_like(own)

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
