"""A channel whose reading is not in proportion to what it measures."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import numpy as np

from vibrojax.effects.base import UNIT_OF_CHANNEL, AbstractChannelFault, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_PROBE_SHARE = 0.01
"""Of the largest reading, by which each term bends it there."""


def _candidates(scales: ProbeScales) -> list["NonlinearReading"]:
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

    Arguments:
        quadratic: e_2, 1 over the channel's SI unit.
        cubic: e_3, 1 over the square of that.
        of_channel: name of the channel.

    Source: E. O. Doebelin, Measurement Systems: Application and Design, 4th edition (1990), chapter 3 (linearity), to the third order.
    """

    name: ClassVar[str] = "nonlinear_reading"
    summary: ClassVar[str] = "a channel with a curved characteristic"
    equation: ClassVar[str] = "r = value + e_2 value^2 + e_3 value^3"
    source: ClassVar[str] = "Doebelin 1990"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=name,
            field=name,
            symbol=symbol,
            unit=unit,
            start=0.0,
            lower=-np.inf,
            logarithmic=False,
            meaning=f"{name} part of the reading",
        )
        for name, symbol, unit in (("quadratic", "e_2", f"1/({UNIT_OF_CHANNEL})"), ("cubic", "e_3", f"1/({UNIT_OF_CHANNEL})^2"))
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, parts=("quadratic", "cubic"), either_sign=True)

    quadratic: Value
    cubic: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "NonlinearReading":
        """Square and cube in proportion."""
        return dataclasses.replace(self, quadratic=factor * self.quadratic, cubic=factor * self.cubic)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel along its characteristic."""
        if self.of_channel not in readings:
            return readings
        value = readings[self.of_channel]
        return readings | {self.of_channel: value + self.quadratic * value * value + self.cubic * value * value * value}
