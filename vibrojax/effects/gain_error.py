"""A channel with a wrong calibration factor."""

import dataclasses
from typing import ClassVar

import equinox as eqx

from vibrojax.effects.base import AbstractChannelFault, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value


class GainError(AbstractChannelFault):
    """One channel shows too much or too little, by a constant factor.

    r = g value. Differentiable everywhere.

    Arguments:
        factor: g, 1.
        of_channel: name of the channel.

    Source: ISO 16063-1, Methods for the calibration of vibration and shock transducers (1998).
    """

    name: ClassVar[str] = "gain_error"
    summary: ClassVar[str] = "a channel whose calibration factor is wrong"
    equation: ClassVar[str] = "r = g value"
    source: ClassVar[str] = "ISO 16063-1"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="factor",
            field="factor",
            symbol="g",
            unit="1",
            start=1.0,
            scale=0.01,
            logarithmic=False,
            meaning="reading over true value",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [GainError(factor=1.01, of_channel=channel) for channel in scales.channels if scales.tied], either_sign=True
    )
    """One hundredth too much, in every channel, where something else sets the size of the motion."""

    factor: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "GainError":
        """Distance from one in proportion."""
        return dataclasses.replace(self, factor=1.0 + factor * (self.factor - 1.0))

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel times its factor."""
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: self.factor * readings[self.of_channel]}
