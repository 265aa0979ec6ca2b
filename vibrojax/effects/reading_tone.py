"""A tone in one channel."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax.effects.base import AbstractChannelFault, Motion, Own, OwnState, Readings, sine_and_cosine
from vibrojax.effects.probe import Probe, ProbeScales, is_of_mains
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_DECAYS = (0.0, 3.0)
"""Decay rates of candidates, over the longest record."""


def _candidates(scales: ProbeScales) -> list["ReadingTone"]:
    """Sine and cosine of every foreign line in the residual of a channel but the mains', steady and decaying, of the size of its noise."""
    longest = max(last - first for first, last in scales.clock.values())
    return [
        ReadingTone(
            frequency_hz=line, decay_rate=decay / longest, sine=scales.noise[channel], cosine=scales.noise[channel], of_channel=channel
        )
        for channel in scales.channels
        for line in scales.foreign_lines(channel)
        if not is_of_mains(line)
        for decay in _DECAYS
    ]


class ReadingTone(AbstractChannelFault):
    """A steady or decaying tone in one channel, unrelated to the motion of the rig: of a stand, a camera, a floor.

    r = value + exp(-s t) (a sin(2 pi f t) + b cos(2 pi f t)), t on the record's clock; a and b are others in every record.
    Differentiable everywhere.

    Arguments:
        frequency_hz: f > 0, Hz.
        decay_rate: s >= 0, 1/s; 0 for a steady tone.
        sine: a, in the channel's SI unit, at the zero of the clock.
        cosine: b, likewise.
        of_channel: name of the channel.

    Source: the free vibration of a damped oscillator; D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 2.
    """

    name: ClassVar[str] = "reading_tone"
    summary: ClassVar[str] = "a steady or decaying tone in a channel"
    equation: ClassVar[str] = "r = value + exp(-s t) (a sin(2 pi f t) + b cos(2 pi f t))"
    source: ClassVar[str] = "Ewins 2000"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="frequency_hz",
            field="frequency_hz",
            symbol="f_t",
            unit="Hz",
            start=10.0,
            lower=1e-3,
            upper=1e5,
            meaning="frequency of the tone",
        ),
        Parameter(
            name="decay_rate", field="decay_rate", symbol="s_t", unit="1/s", start=0.0, logarithmic=False, meaning="decay rate of the tone"
        ),
        *sine_and_cosine(("a_t", "b_t"), "the tone"),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, parts=("sine", "cosine"), either_sign=True, is_line=True)

    frequency_hz: Value
    decay_rate: Value
    sine: Value
    cosine: Value
    of_channel: str = eqx.field(static=True, default="")

    @property
    def special_cases(self) -> tuple[str, ...]:
        """One that does not decay."""
        return ("mains_hum",)

    def scaled(self, factor: Value) -> "ReadingTone":
        """Tone in proportion, at the same frequency and decay."""
        return dataclasses.replace(self, sine=factor * self.sine, cosine=factor * self.cosine)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel with the tone on it."""
        if self.of_channel not in readings:
            return readings
        angle = 2.0 * jnp.pi * self.frequency_hz * motion.t
        tone = jnp.exp(-self.decay_rate * motion.t) * (self.sine * jnp.sin(angle) + self.cosine * jnp.cos(angle))
        return readings | {self.of_channel: readings[self.of_channel] + tone}
