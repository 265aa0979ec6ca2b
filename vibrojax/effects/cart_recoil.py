"""A cart that recoils under the impacts."""

import dataclasses
import math
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_MOST_CYCLES = 2.0
"""Of a candidate's cart in the course of a contact: a faster one acts like a spring."""
_RATIO = 1.22
"""From one candidate's frequency to the next."""
_PROBE_DAMPING = 0.1
_PROBE_MASS = 10.0
"""Of a candidate's cart, relative to the hammer's."""
_IMMOVABLE = 1e15
"""kg"""


def _candidates(scales: ProbeScales) -> list["CartRecoil"]:
    """A cart of ten times the hammer's mass, at several frequencies."""
    if math.isnan(scales.contact_time):
        return []
    frequencies = scales.frequencies(_RATIO, _MOST_CYCLES / scales.contact_time)
    return [CartRecoil(_PROBE_MASS * scales.mass, f, _PROBE_DAMPING) for f in frequencies]


class CartRecoil(AbstractEffect):
    """The cart recoils from the impacts, elastically held in its prescribed motion.

    M_c r'' = F - k_c r - c_c r',   y = prescribed motion + r,   k_c = M_c (2 pi f_c)^2,   c_c = 2 zeta_c M_c 2 pi f_c.

    Only the impacts move it, the suspension's forces do not. Differentiable everywhere.

    Arguments:
        cart_mass: M_c > 0, kg.
        cart_frequency_hz: f_c > 0, Hz.
        cart_damping_ratio: zeta_c > 0, 1.

    Source: J. P. Den Hartog, Mechanical Vibrations (1934), chapter 2, a mass on a spring.
    """

    name: ClassVar[str] = "cart_recoil"
    summary: ClassVar[str] = "a cart that recoils under the impacts"
    equation: ClassVar[str] = "M_c r'' = F - k_c r - c_c r',  y -> y + r"
    source: ClassVar[str] = "Den Hartog 1934"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="cart_mass", field="cart_mass", symbol="M_c", unit="kg", start=5.0, lower=1e-3, upper=1e9, meaning="mass of the cart"
        ),
        Parameter(
            name="cart_frequency_hz",
            field="cart_frequency_hz",
            symbol="f_c",
            unit="Hz",
            start=15.0,
            lower=0.1,
            upper=1e6,
            meaning="natural frequency of the cart",
        ),
        Parameter(
            name="cart_damping_ratio",
            field="cart_damping_ratio",
            symbol="ζ_c",
            unit="1",
            start=0.1,
            lower=1e-4,
            upper=10.0,
            meaning="damping ratio of the cart",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="recoil", unit="m", scale=1e-3),
        OwnState(name="recoil_velocity", unit="m/s", scale=0.05),
    )
    probe: ClassVar[Probe] = Probe(_candidates)

    cart_mass: Value
    cart_frequency_hz: Value
    cart_damping_ratio: Value

    def scaled(self, factor: Value) -> "CartRecoil":
        """A cart that much lighter, at the same frequency and damping ratio; as good as immovable for a factor of zero."""
        moves = jnp.asarray(factor) > 0
        return dataclasses.replace(self, cart_mass=jnp.where(moves, self.cart_mass / jnp.where(moves, factor, 1.0), _IMMOVABLE))

    @property
    def fastest_hz(self) -> Value:
        """Of the cart, Hz."""
        return self.cart_frequency_hz

    def base_displacement(self, own: Own) -> Scalars:
        """r, m."""
        return own[..., 0]

    def base_acceleration(self, own: Own, push: Scalars) -> Scalars:
        """r'', m/s^2."""
        r, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.cart_frequency_hz
        return push / self.cart_mass - omega**2 * r - 2.0 * self.cart_damping_ratio * omega * v

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """r' and r''."""
        return jnp.stack([own[..., 1], self.base_acceleration(own, push)], axis=-1)
