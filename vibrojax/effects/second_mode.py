"""A second vibrating mode on the hammer."""

import dataclasses
import math
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_HIGHEST = 100.0
"""Highest frequency of candidates over f_n."""
_RATIO = 1.1
"""From one candidate's frequency to the next."""
_PROBE_DAMPING = 0.03
_PROBE_MASS = 0.05
"""Of a candidate, relative to the hammer's."""


def _candidates(scales: ProbeScales) -> list["SecondMode"]:
    """A twentieth of the hammer's mass, at several frequencies that the records can show."""
    highest = _HIGHEST * scales.f_n if scales.f_n > 0 else math.inf
    return [SecondMode(_PROBE_MASS * scales.mass, f, _PROBE_DAMPING) for f in scales.frequencies(_RATIO, highest)]


class SecondMode(AbstractEffect):
    """A mass that hangs on the hammer by a spring and a damper: a second mode of the hammer or its suspension.

    m_2 (w'' + x'') = -(k_2 w + c_2 w'),   force = k_2 w + c_2 w',   k_2 = m_2 (2 pi f_2)^2,   c_2 = 2 zeta_2 m_2 2 pi f_2,

    w its displacement relative to the hammer. The hammer keeps its own mass beside it. Differentiable everywhere.

    Arguments:
        mode_mass: m_2 > 0, kg.
        mode_frequency_hz: f_2 > 0, Hz, with the hammer held.
        mode_damping_ratio: zeta_2 > 0, 1.

    Source: J. Ormondroyd, J. P. Den Hartog, The theory of the dynamic vibration absorber, Trans. ASME 50 (1928) APM-50-7.
    """

    name: ClassVar[str] = "second_mode"
    summary: ClassVar[str] = "a second vibrating mode on the hammer or its suspension"
    equation: ClassVar[str] = "m_2 (w'' + x'') = -(k_2 w + c_2 w'),  force = k_2 w + c_2 w'"
    source: ClassVar[str] = "Ormondroyd and Den Hartog 1928"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="mode_mass", field="mode_mass", symbol="m_2", unit="kg", start=0.05, lower=1e-9, upper=1e6, meaning="mass of the mode"
        ),
        Parameter(
            name="mode_frequency_hz",
            field="mode_frequency_hz",
            symbol="f_2",
            unit="Hz",
            start=30.0,
            lower=0.1,
            upper=1e6,
            meaning="natural frequency of the mode",
        ),
        Parameter(
            name="mode_damping_ratio",
            field="mode_damping_ratio",
            symbol="ζ_2",
            unit="1",
            start=0.03,
            lower=1e-5,
            upper=2.0,
            meaning="damping ratio of the mode",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="mode_displacement", unit="m", scale=1e-3),
        OwnState(name="mode_velocity", unit="m/s", scale=0.05),
    )
    probe: ClassVar[Probe] = Probe(_candidates)

    mode_mass: Value
    mode_frequency_hz: Value
    mode_damping_ratio: Value

    def scaled(self, factor: Value) -> "SecondMode":
        """Mass in proportion, at the same frequency and damping ratio."""
        return dataclasses.replace(self, mode_mass=factor * self.mode_mass)

    @property
    def fastest_hz(self) -> Value:
        """Of the mode, Hz."""
        return self.mode_frequency_hz

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Of its spring and damper, N."""
        return self.mode_mass * self._restoring(own)

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """w' and w''."""
        return jnp.stack([own[..., 1], -acceleration - self._restoring(own)], axis=-1)

    def _restoring(self, own: Own) -> Scalars:
        """Force of spring and damper per mass, m/s^2."""
        omega = 2.0 * jnp.pi * self.mode_frequency_hz
        return omega**2 * own[..., 0] + 2.0 * self.mode_damping_ratio * omega * own[..., 1]
