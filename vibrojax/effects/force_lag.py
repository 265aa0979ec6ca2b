"""A load cell behind a low-pass filter."""

import dataclasses
import math
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.first_order import low_passed
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_LAG_GRID = (1 / 32, 1 / 16, 1 / 8, 1 / 4)
"""Of candidates, over the duration of a contact."""


def _candidates(scales: ProbeScales) -> list["ForceLag"]:
    """Several time constants, and the delay that the records show."""
    if "impact_force" not in scales.channels or math.isnan(scales.contact_time):
        return []
    recorded = scales.lags.get("impact_force", 0.0)
    lags = [part * scales.contact_time for part in _LAG_GRID] + ([recorded] if recorded > 0 else [])
    return [ForceLag(lag) for lag in lags]


class ForceLag(AbstractEffect):
    """The force channel goes through a low-pass of first order, on its samples.

    r_i = a_i r_(i-1) + (1 - a_i) F_i,   a_i = exp(-(t_i - t_(i-1)) / tau).

    The filter starts with the first sample's force and the decaying response to impacts before that, of time constant tau. Beside
    an analogue filter of the same tau its output comes half a sample early.
    Differentiable for tau > 0.

    Arguments:
        lag: tau >= 0, s.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order.
    """

    name: ClassVar[str] = "force_lag"
    summary: ClassVar[str] = "a force channel that is low-passed or late"
    equation: ClassVar[str] = "r_i = a r_(i-1) + (1 - a) F_i,  a = exp(-dt/tau)"
    source: ClassVar[str] = "Oppenheim and Schafer 1989"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="lag", field="lag", symbol="τ", unit="s", start=1e-3, lower=1e-7, upper=1.0, meaning="time constant of the low-pass"
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="memory", unit="N", scale=100.0, carried=False),)
    probe: ClassVar[Probe] = Probe(_candidates, delay="lag")

    lag: Value

    @property
    def is_fault(self) -> bool:
        """Yes."""
        return True

    def scaled(self, factor: Value) -> "ForceLag":
        """Time constant in proportion."""
        return dataclasses.replace(self, lag=factor * self.lag)

    @property
    def channel(self) -> str | None:
        """The load cell's."""
        return "impact_force"

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """None: the state is the filter's response at the first sample to impacts before it, N."""
        return jnp.zeros_like(own)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The load cell's channel through the filter."""
        if "impact_force" not in readings:
            return readings
        filtered = low_passed(motion.t, readings["impact_force"], self.lag, own[0, 0])
        return readings | {"impact_force": filtered}

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """The filter's, N."""
        return (shown["impact_force"] - readings["impact_force"])[:, None] if "impact_force" in readings else own
