"""A sensor that is AC coupled or discharges."""

import dataclasses
import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from vibrojax.channel_units import UNITS
from vibrojax.effects.base import UNIT_OF_CHANNEL, AbstractChannelFault, Motion, Own, OwnState, Readings
from vibrojax.effects.first_order import high_passed
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PIEZOELECTRIC = ("N", "m/s^2")
"""Units of the channels whose sensors are charge or AC coupled."""
_SHORTEST, _LONGEST = 3.0, 3.0
"""Time constants of candidates: from so many contact durations to so many of the longest record."""
_RATIO = 3.0
"""From one candidate's time constant to the next, at most."""
_NEVER = 1e12
"""s; a time constant with which nothing discharges."""


def _candidates(scales: ProbeScales) -> list["SensorHighPass"]:
    """Every cell and accelerometer, over a grid of time constants; without impacts, from a period of the suspension on."""
    longest = _LONGEST * max(last - first for first, last in scales.clock.values())
    shortest = _SHORTEST * scales.contact_time if math.isfinite(scales.contact_time) else 1.0 / scales.f_n if scales.f_n > 0 else longest
    count = 1 + max(math.ceil(math.log(longest / shortest) / math.log(_RATIO)), 1)
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

    Arguments:
        time_constant: tau > 0, s.
        of_channel: name of the channel.

    Source: G. Gautschi, Piezoelectric Sensorics (2002), on the time constant of charge amplifiers; filter of first order as in A. V.
    Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989).
    """

    name: ClassVar[str] = "sensor_high_pass"
    summary: ClassVar[str] = "a force cell or accelerometer that is AC coupled or discharges"
    equation: ClassVar[str] = "r_i = a (r_(i-1) + x_i - x_(i-1)),  a = exp(-dt/tau)"
    source: ClassVar[str] = "Gautschi 2002"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="time_constant",
            field="time_constant",
            symbol="τ_s",
            unit="s",
            start=1.0,
            lower=1e-6,
            upper=1e6,
            meaning="time constant of the discharge",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="charge", unit=UNIT_OF_CHANNEL, scale=100.0, carried=False),)
    probe: ClassVar[Probe] = Probe(_candidates)

    time_constant: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "SensorHighPass":
        """Rate of discharge in proportion: none for a factor of zero."""
        factor = jnp.asarray(factor)
        return dataclasses.replace(
            self, time_constant=jnp.where(factor > 0, self.time_constant / jnp.where(factor > 0, factor, 1.0), _NEVER)
        )

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """None: the state is what the filter has lost by the first sample, turned round, in the channel's unit."""
        return jnp.zeros_like(own)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel through the filter."""
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: high_passed(motion.t, readings[self.of_channel], self.time_constant, own[0, 0])}

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """The filter's, in the channel's unit."""
        return (shown[self.of_channel] - readings[self.of_channel])[:, None] if self.of_channel in readings else own
