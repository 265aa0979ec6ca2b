"""An interference line in one channel."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax.effects.base import AbstractChannelFault, Motion, Own, OwnState, Readings, sine_and_cosine
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_LOWEST_HZ, _HIGHEST_HZ = 15.0, 1000.0


def _candidates(scales: ProbeScales) -> list["MainsHum"]:
    """Sine and cosine of every strong line in the residual of a channel, of the size of its noise."""
    return [
        MainsHum(frequency_hz=line, sine=scales.noise[channel], cosine=scales.noise[channel], of_channel=channel)
        for channel in scales.channels
        for line in scales.foreign_lines(channel)
        if _LOWEST_HZ <= line <= _HIGHEST_HZ
    ]


class MainsHum(AbstractChannelFault):
    """A steady line in one channel, unrelated to the excitation; its phase is another in every record.

    r = value + a sin(2 pi f t) + b cos(2 pi f t), t on the record's clock. Differentiable everywhere.

    Arguments:
        frequency_hz: f > 0, Hz.
        sine: a, in the channel's SI unit.
        cosine: b, likewise.
        of_channel: name of the channel.

    Source: G. Vasilescu, Electronic Noise and Interfering Signals (2005).
    """

    name: ClassVar[str] = "mains_hum"
    summary: ClassVar[str] = "an interference line in a channel"
    equation: ClassVar[str] = "r = value + a sin(2 pi f t) + b cos(2 pi f t)"
    source: ClassVar[str] = "Vasilescu 2005"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="frequency_hz",
            field="frequency_hz",
            symbol="f_h",
            unit="Hz",
            start=50.0,
            lower=1.0,
            upper=1e5,
            meaning="frequency of the line",
        ),
        *sine_and_cosine(("a_h", "b_h"), "the line"),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, parts=("sine", "cosine"), either_sign=True, is_line=True)

    frequency_hz: Value
    sine: Value
    cosine: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "MainsHum":
        """Line in proportion, at the same frequency."""
        return dataclasses.replace(self, sine=factor * self.sine, cosine=factor * self.cosine)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel with the line on it."""
        if self.of_channel not in readings:
            return readings
        angle = 2.0 * jnp.pi * self.frequency_hz * motion.t
        return readings | {self.of_channel: readings[self.of_channel] + self.sine * jnp.sin(angle) + self.cosine * jnp.cos(angle)}
