"""A channel whose clock runs fast or slow."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import numpy as np

from vibrojax.effects.base import AbstractChannelFault, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.effects.time_offset import interpolated
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PROBE_DELAY = 0.5
"""Of the shortest sampling interval, by the end of the longest record."""
_PPM = 1e-6


def _candidates(scales: ProbeScales) -> list["ClockDrift"]:
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

    Arguments:
        drift_ppm: parts in a million; above zero the channel comes later and later.
        of_channel: name of the channel.

    Source: J. Elson, K. Roemer, Wireless sensor networks: a new regime for time synchronization, ACM SIGCOMM Computer Communication Review
    33 (2003) 149-154 (clock skew); interpolation as in `time_offset`.
    """

    name: ClassVar[str] = "clock_drift"
    summary: ClassVar[str] = "a channel whose clock differs from the others' by a constant factor"
    equation: ClassVar[str] = "r(t) = value(t (1 - ppm 1e-6))"
    source: ClassVar[str] = "Elson and Roemer 2003"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="drift_ppm",
            field="drift_ppm",
            symbol="ppm",
            unit="ppm",
            start=0.0,
            lower=-np.inf,
            scale=100.0,
            logarithmic=False,
            meaning="time that the channel loses, in parts of a million of the record's",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, either_sign=True)

    drift_ppm: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "ClockDrift":
        """Drift in proportion."""
        return dataclasses.replace(self, drift_ppm=factor * self.drift_ppm)

    def lateness(self, t: Scalars) -> Scalars:
        """In proportion to the time, s."""
        return _PPM * self.drift_ppm * t

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel as it was on the other clock."""
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: interpolated(motion.t - self.lateness(motion.t), motion.t, readings[self.of_channel])}
