"""A channel that is shifted in time."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from vibrojax.effects.base import AbstractChannelFault, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PROBE_DELAY = 0.5
"""Of the shortest sampling interval."""
_POINTS = 4
"""Of the interpolation."""


def _candidates(scales: ProbeScales) -> list["TimeOffset"]:
    """Half a sample late, in every channel; and as late as the records show it."""
    late = [TimeOffset(delay=_PROBE_DELAY * scales.sampling, of_channel=channel) for channel in scales.channels]
    recorded = [TimeOffset(delay=scales.lags[channel], of_channel=channel) for channel in scales.channels if channel in scales.lags]
    return [*late, *recorded]


class TimeOffset(AbstractChannelFault):
    """One channel comes late, or early, against the others.

    r(t) = value(t - d), by the cubic through the four samples around; beyond the ends of what was integrated, the outermost
    cubic goes on.
    Differentiable, in d but where t - d is a sample: there the slope of one side.

    Arguments:
        delay: d, s; above zero the channel comes late.
        of_channel: name of the channel.

    Source: T. I. Laakso, V. Valimaki, M. Karjalainen, U. K. Laine, Splitting the unit delay, IEEE Signal Processing Magazine 13 (1996)
    30-60.
    """

    name: ClassVar[str] = "time_offset"
    summary: ClassVar[str] = "a channel that is shifted in time against the others"
    equation: ClassVar[str] = "r(t) = value(t - d)"
    source: ClassVar[str] = "Laakso et al. 1996"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="delay",
            field="delay",
            symbol="d",
            unit="s",
            start=0.0,
            lower=-np.inf,
            scale=1e-3,
            logarithmic=False,
            meaning="time by which the channel is late",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, either_sign=True, delay="delay")

    delay: Value
    of_channel: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "TimeOffset":
        """Delay in proportion."""
        return dataclasses.replace(self, delay=factor * self.delay)

    def lateness(self, t: Scalars) -> Scalars:
        """The delay, s."""
        return self.delay + jnp.zeros_like(t)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The channel as it was a delay before."""
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: interpolated(motion.t - self.lateness(motion.t), motion.t, readings[self.of_channel])}


def interpolated(at: Float[Array, " time"], ts: Float[Array, " time"], values: Float[Array, " time"]) -> Float[Array, " time"]:
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
