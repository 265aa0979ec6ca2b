"""A stop that is itself a sprung mass."""

import dataclasses
import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_CYCLES_GRID = tuple(float(cycles) for cycles in np.geomspace(0.4, 8.0, 13))
"""Of candidates' stops in the course of a contact."""
_STIFFER = 10.0
"""Stiffness of a candidate under the stop, relative to that of the contact at its deepest."""
_PROBE_DAMPING = 0.05
_RIGID = 1e15
"""N/m; as if the stop stood fast, and its load cell read the force of the contact."""


def _candidates(scales: ProbeScales) -> list["StopCompliance"]:
    """A stop ten times as stiff as the contact at its deepest, at several frequencies."""
    if math.isnan(scales.contact_time):
        return []
    stiffness = _STIFFER * scales.force / (scales.speed * scales.contact_time / 3.0)
    frequencies = (cycles / scales.contact_time for cycles in _CYCLES_GRID)
    return [StopCompliance(stiffness, f, _PROBE_DAMPING) for f in frequencies if f * scales.sampling < 1.0]


class StopCompliance(AbstractEffect):
    """The stop, or the load cell that carries it, is compliant and has a resonance of its own.

    m_s s'' = max(F, 0) - k_s s - c_s s',   gap + s instead of gap,   the load cell reads k_s s + c_s s'.

    s is relative to the cart, whose acceleration does not count against that of the stop; m_s = k_s / (2 pi f_s)^2 and
    c_s = 2 zeta_s k_s / (2 pi f_s). What the load cell reads is the force behind the stop: it rings on after separation, below zero too.
    Differentiable everywhere.

    Arguments:
        stop_stiffness: k_s > 0, N/m.
        stop_frequency_hz: f_s > 0, Hz, of the stop by itself.
        stop_damping_ratio: zeta_s > 0, 1.

    Source: J. P. Den Hartog, Mechanical Vibrations (1934), chapter 2, a mass on a spring; as the front end of a load cell.
    """

    name: ClassVar[str] = "stop_compliance"
    summary: ClassVar[str] = "a compliant stop or load cell with a resonance"
    equation: ClassVar[str] = "m_s s'' = max(F, 0) - k_s s - c_s s',  gap -> gap + s,  load cell = k_s s + c_s s'"
    source: ClassVar[str] = "Den Hartog 1934"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="stop_stiffness", field="stop_stiffness", symbol="k_s", unit="N/m", start=1e6, lower=1e2, upper=1e12, meaning="stiffness"
        ),
        Parameter(
            name="stop_frequency_hz",
            field="stop_frequency_hz",
            symbol="f_s",
            unit="Hz",
            start=500.0,
            lower=10.0,
            upper=1e6,
            meaning="natural frequency of the stop by itself",
        ),
        Parameter(
            name="stop_damping_ratio",
            field="stop_damping_ratio",
            symbol="ζ_s",
            unit="1",
            start=0.05,
            lower=1e-5,
            upper=2.0,
            meaning="damping ratio of the stop",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="stop_displacement", unit="m", scale=1e-4),
        OwnState(name="stop_velocity", unit="m/s", scale=0.3),
    )
    probe: ClassVar[Probe] = Probe(_candidates)

    stop_stiffness: Value
    stop_frequency_hz: Value
    stop_damping_ratio: Value

    def scaled(self, factor: Value) -> "StopCompliance":
        """Compliance in proportion, at the same frequency and damping ratio: the stop's mass falls with the factor's inverse."""
        gives_way = jnp.asarray(factor) > 0
        stiffness = jnp.where(gives_way, self.stop_stiffness / jnp.where(gives_way, factor, 1.0), _RIGID)
        return dataclasses.replace(self, stop_stiffness=stiffness)

    @property
    def fastest_hz(self) -> Value:
        """Of the stop by itself, Hz."""
        return self.stop_frequency_hz

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        """s, m."""
        return own[..., 0]

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        """s', m/s."""
        return own[..., 1]

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """s' and s''; only a push of the stop in front moves it."""
        s, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.stop_frequency_hz
        pushed = omega**2 / self.stop_stiffness * jnp.maximum(push, 0.0)
        return jnp.stack([v, pushed - omega**2 * s - 2.0 * self.stop_damping_ratio * omega * v], axis=-1)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The force behind the stop in the load cell, N."""
        if "impact_force" not in readings:
            return readings
        s, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.stop_frequency_hz
        behind = self.stop_stiffness * (s + 2.0 * self.stop_damping_ratio / omega * v)
        force = readings["impact_force"]
        return readings | {"impact_force": jnp.where(jnp.asarray(self.stop_stiffness) < _RIGID, behind, force)}
