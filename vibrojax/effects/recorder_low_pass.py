"""A recorder whose filter acts on all channels."""

import dataclasses
import math
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.channel_units import EVERY_CHANNEL, UNITS
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.first_order import low_passed
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_RATIO = 2.0
"""From one candidate's cut-off to the next."""
_SIZES = {"m": 1e-3, "m/s^2": 10.0, "N": 100.0}
"""Of a filter's memory, by the unit of its channel."""


def _candidates(scales: ProbeScales) -> list["RecorderLowPass"]:
    """A grid of cut-off frequencies, from somewhat below the suspension's to somewhat below Nyquist's."""
    return [RecorderLowPass(1.0 / (2.0 * math.pi * cut_off)) for cut_off in scales.frequencies(_RATIO) if scales.channels]


class RecorderLowPass(AbstractEffect):
    """All channels go through one low-pass of first order, on their samples: the anti-aliasing filter of the recorder.

    r_i = a_i r_(i-1) + (1 - a_i) x_i,   a_i = exp(-(t_i - t_(i-1)) / tau),   in every channel, with the cut-off frequency 1/(2 pi tau).

    Each filter starts with the first sample's value, settled, and the decaying response to what was before that. Beside an analogue
    filter of the same tau its output comes half a sample early. A motion of the cart or an applied force that is measured and drives the
    model is taken as recorded, behind the filter. Differentiable for tau > 0.

    Arguments:
        time_constant: tau >= 0, s.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (1989): the recursive filter of first order; anti-aliasing as in
    D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 3.
    """

    name: ClassVar[str] = "recorder_low_pass"
    summary: ClassVar[str] = "a recorder that low-passes all channels alike"
    equation: ClassVar[str] = "r_i = a r_(i-1) + (1 - a) x_i in every channel,  a = exp(-dt/tau)"
    source: ClassVar[str] = "Oppenheim and Schafer 1989"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="time_constant",
            field="time_constant",
            symbol="τ_r",
            unit="s",
            start=1e-3,
            lower=1e-7,
            upper=1.0,
            meaning="time constant of the low-pass",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = tuple(
        OwnState(name=channel, unit=UNITS[channel], scale=_SIZES[UNITS[channel]], carried=False) for channel in EVERY_CHANNEL
    )
    """Memory of the filter of every channel that a recorder can have, whether it is recorded or not."""
    probe: ClassVar[Probe] = Probe(_candidates)

    time_constant: Value

    @property
    def is_fault(self) -> bool:
        """Yes."""
        return True

    def scaled(self, factor: Value) -> "RecorderLowPass":
        """Time constant in proportion."""
        return dataclasses.replace(self, time_constant=factor * self.time_constant)

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """None: the states are the filters' responses at the first sample to what was before it."""
        return jnp.zeros_like(own)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """All channels through the filter."""
        recorded = [name for name in EVERY_CHANNEL if name in readings]
        if not recorded:
            return readings
        values = jnp.stack([readings[name] for name in recorded], axis=-1)
        memory = jnp.stack([own[0, EVERY_CHANNEL.index(name)] for name in recorded])
        filtered = low_passed(motion.t, values, self.time_constant, memory)
        return readings | {name: filtered[:, place] for place, name in enumerate(recorded)}

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """The filters', each in the unit of its channel."""
        columns = [shown[name] - readings[name] if name in readings else own[:, place] for place, name in enumerate(EVERY_CHANNEL)]
        return jnp.stack(columns, axis=-1)
