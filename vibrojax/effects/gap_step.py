"""A gap that changes at one instant."""

import dataclasses
import itertools
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from vibrojax import smooth
from vibrojax.effects.base import AbstractEffect, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PROBE_JUMP = 2e-3
"""Of the largest deflection."""
_WIDTH = 1e-3
"""s; the jump is spread over it."""


def _candidates(scales: ProbeScales) -> list["GapStep"]:
    """One for every flight between two impacts of every record."""
    jump = _PROBE_JUMP * scales.amplitude
    return [
        GapStep(jump, 0.5 * (left + touched), in_file=file)
        for file, contacts in scales.contacts.items()
        for (_, left), (touched, _) in itertools.pairwise(contacts)
    ]


class GapStep(AbstractEffect):
    """The stop slips, at one instant of one record.

    gap(t) = gap + j H(t - t_s), with H a step spread over 1 ms. Differentiable everywhere; in t_s the derivative is zero unless the hammer
    touches the stop within that millisecond; that width limits how well it is identifiable.

    Arguments:
        gap_jump: j, m; above zero the gap opens.
        instant: t_s, s, on the record's clock.
        in_file: file of the record.

    Source: kinematics.
    """

    name: ClassVar[str] = "gap_step"
    summary: ClassVar[str] = "a gap that changes suddenly at one instant"
    equation: ClassVar[str] = "gap(t) = gap + j H(t - t_s)"
    source: ClassVar[str] = "kinematics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gap_jump",
            field="gap_jump",
            symbol="j",
            unit="m",
            start=1e-4,
            lower=-np.inf,
            scale=1e-4,
            logarithmic=False,
            meaning="change of the gap",
        ),
        Parameter(
            name="instant",
            field="instant",
            symbol="t_s",
            unit="s",
            start=0.0,
            lower=-np.inf,
            logarithmic=False,
            searched=True,
            resolution=_WIDTH / np.sqrt(12.0),
            meaning="time of the change",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, either_sign=True)

    gap_jump: Value
    instant: Value
    in_file: str = eqx.field(static=True, default="")

    def scaled(self, factor: Value) -> "GapStep":
        """Jump in proportion, at the same instant."""
        return dataclasses.replace(self, gap_jump=factor * self.gap_jump)

    @property
    def record(self) -> str | None:
        """The file, or None where none is given: then all."""
        return self.in_file or None

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        """Before and after the jump, m."""
        return self.gap_jump * smooth.step(t - self.instant, _WIDTH)

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        """Derivative of the step, m/s."""
        s = jnp.clip((t - self.instant) / _WIDTH + 0.5, 0.0, 1.0)
        return self.gap_jump * 30.0 / _WIDTH * (s * (1.0 - s)) ** 2
