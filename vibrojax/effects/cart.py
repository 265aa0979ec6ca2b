"""What the nominal model may leave out of the cart's motion: a drifting frequency, harmonics, and recoil from the impacts."""

import dataclasses
import math
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax import smooth
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.excitation import AbstractBaseMotion, Harmonic, SampledMotion
from vibrojax.parameters import parameter
from vibrojax.shapes import Scalars, Value

_PROBE_PHASE = 0.05
"""rad; advance of a candidate's drive at the end of the longest record."""


class DriftingMotion(AbstractBaseMotion):
    """A motion of the cart whose clock speeds up: y(t) = motion(t + rate t^2 / 2).

    Arguments:
        motion: at a steady frequency.
        rate: 1/s.
    """

    motion: AbstractBaseMotion
    rate: Value

    def displacement(self, t: Scalars) -> Scalars:
        return self.motion.displacement(self._reached(t))

    def velocity(self, t: Scalars) -> Scalars:
        return self.motion.velocity(self._reached(t)) * (1.0 + self.rate * t)

    def acceleration(self, t: Scalars) -> Scalars:
        reached = self._reached(t)
        return self.motion.acceleration(reached) * (1.0 + self.rate * t) ** 2 + self.motion.velocity(reached) * self.rate

    def _reached(self, t: Scalars) -> Scalars:
        return t * (1.0 + 0.5 * self.rate * t)


def _frequency_drifts(scales: ProbeScales) -> list["FrequencyDrift"]:
    """A twentieth of a radian by the end of the longest record."""
    if scales.omega_exc == 0 or scales.latest == 0:
        return []
    return [FrequencyDrift(2.0 * _PROBE_PHASE / (scales.omega_exc * scales.latest**2))]


class FrequencyDrift(AbstractEffect):
    """A drive that speeds up or slows down steadily from the zero of the record's clock.

    y = A0 sin(Omega (t + rate t^2 / 2) + base_phase): the frequency is f (1 + rate t). A cart whose motion was measured stays as it is.

    Source: a linear sweep; D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 3.
    """

    name: ClassVar[str] = "frequency_drift"
    summary: ClassVar[str] = "a drive whose frequency drifts during a record"
    equation: ClassVar[str] = "f(t) = f (1 + r t)"
    source: ClassVar[str] = "Ewins 2000"
    probe: ClassVar[Probe] = Probe(_frequency_drifts, either_sign=True)

    drift_rate: Value = parameter("r", "1/s", start=1e-3, lower=-np.inf, scale=1e-3, meaning="relative change of the frequency per second")

    def base(self, base: AbstractBaseMotion) -> AbstractBaseMotion:
        return base if isinstance(base, SampledMotion) else DriftingMotion(motion=base, rate=self.drift_rate)


_HARMONIC = 0.01
"""Of a candidate's harmonics, over the first."""


class ImpureHarmonic(AbstractBaseMotion):
    """A sine with its second and third harmonic, in fixed proportion and phase to it.

    y = A0 [sin a + s_2 sin 2a + c_2 cos 2a + s_3 sin 3a + c_3 cos 3a],  a = Omega t + base_phase.

    Arguments:
        sine: the first line.
        second: (s_2, c_2), 1.
        third: (s_3, c_3), 1.
    """

    sine: Harmonic
    second: tuple[Value, Value]
    third: tuple[Value, Value]

    def displacement(self, t: Scalars) -> Scalars:
        (s1, s2, s3), (_, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        return self.sine.base_amplitude * (s1 + a2 * s2 + b2 * c2 + a3 * s3 + b3 * c3)

    def velocity(self, t: Scalars) -> Scalars:
        (_, s2, s3), (c1, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        slope = c1 + 2.0 * (a2 * c2 - b2 * s2) + 3.0 * (a3 * c3 - b3 * s3)
        return self.sine.base_amplitude * 2.0 * jnp.pi * self.sine.frequency_hz * slope

    def acceleration(self, t: Scalars) -> Scalars:
        (s1, s2, s3), (_, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        bend = s1 + 4.0 * (a2 * s2 + b2 * c2) + 9.0 * (a3 * s3 + b3 * c3)
        return -self.sine.base_amplitude * (2.0 * jnp.pi * self.sine.frequency_hz) ** 2 * bend

    def _lines(self, t: Scalars):
        """Sines and cosines of a, 2a and 3a."""
        angle = 2.0 * jnp.pi * self.sine.frequency_hz * t + self.sine.base_phase
        s, c = smooth.sine(angle), smooth.cosine(angle)
        return (s, 2.0 * s * c, s * (3.0 - 4.0 * s * s)), (c, 1.0 - 2.0 * s * s, c * (4.0 * c * c - 3.0))


def _coefficient(symbol: str, meaning: str) -> Any:
    return parameter(symbol, "1", start=_HARMONIC, lower=-np.inf, scale=_HARMONIC, meaning=meaning)


class BaseHarmonics(AbstractEffect):
    """A drive with a second and a third harmonic, relative to the first and alike in all records.

    y = A0 [sin a + s_2 sin 2a + c_2 cos 2a + s_3 sin 3a + c_3 cos 3a],  a = Omega t + base_phase. A cart whose motion was measured stays
    as it is. Differentiable everywhere.

    Source: J. Fourier, Theorie analytique de la chaleur (1822).
    """

    name: ClassVar[str] = "base_harmonics"
    summary: ClassVar[str] = "a motion of the cart that is not a pure sine"
    equation: ClassVar[str] = "y = A0 [sin a + s_2 sin 2a + c_2 cos 2a + s_3 sin 3a + c_3 cos 3a],  a = Omega t + phase"
    source: ClassVar[str] = "Fourier 1822"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [BaseHarmonics(_HARMONIC, _HARMONIC, _HARMONIC, _HARMONIC)] if scales.omega_exc else [],
        parts=("second_sine", "second_cosine", "third_sine", "third_cosine"),
        either_sign=True,
    )
    """A hundredth in each of the four lines, estimated together."""

    second_sine: Value = _coefficient("s_2", "second harmonic, sine")
    second_cosine: Value = _coefficient("c_2", "second harmonic, cosine")
    third_sine: Value = _coefficient("s_3", "third harmonic, sine")
    third_cosine: Value = _coefficient("c_3", "third harmonic, cosine")

    def base(self, base: AbstractBaseMotion) -> AbstractBaseMotion:
        if isinstance(base, DriftingMotion):
            return dataclasses.replace(base, motion=self.base(base.motion))
        if not isinstance(base, Harmonic):
            return base
        second, third = (self.second_sine, self.second_cosine), (self.third_sine, self.third_cosine)
        return ImpureHarmonic(sine=base, second=second, third=third)


_MOST_CYCLES = 2.0
"""Of a candidate's cart in the course of a contact: a faster one acts like a spring."""
_RATIO = 1.22
"""From one candidate's frequency to the next."""
_PROBE_DAMPING = 0.1
_PROBE_MASS = 10.0
"""Of a candidate's cart, relative to the hammer's."""
_IMMOVABLE = 1e15
"""kg"""


def _recoils(scales: ProbeScales) -> list["CartRecoil"]:
    """A cart of ten times the hammer's mass, at several frequencies."""
    if math.isnan(scales.contact_time):
        return []
    frequencies = scales.frequencies(_RATIO, _MOST_CYCLES / scales.contact_time)
    return [CartRecoil(_PROBE_MASS * scales.mass, f, _PROBE_DAMPING) for f in frequencies]


class CartRecoil(AbstractEffect):
    """The cart recoils from the impacts, elastically held in its prescribed motion.

    M_c r'' = F - k_c r - c_c r',   y = prescribed motion + r,   k_c = M_c (2 pi f_c)^2,   c_c = 2 zeta_c M_c 2 pi f_c.

    Only the impacts move it, the suspension's forces do not. Differentiable everywhere.

    Source: J. P. Den Hartog, Mechanical Vibrations (1934), chapter 2, a mass on a spring.
    """

    name: ClassVar[str] = "cart_recoil"
    summary: ClassVar[str] = "a cart that recoils under the impacts"
    equation: ClassVar[str] = "M_c r'' = F - k_c r - c_c r',  y -> y + r"
    source: ClassVar[str] = "Den Hartog 1934"
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="recoil", unit="m", scale=1e-3),
        OwnState(name="recoil_velocity", unit="m/s", scale=0.05),
    )
    probe: ClassVar[Probe] = Probe(_recoils)

    cart_mass: Value = parameter("M_c", "kg", start=5.0, lower=1e-3, upper=1e9, meaning="mass of the cart")
    cart_frequency_hz: Value = parameter("f_c", "Hz", start=15.0, lower=0.1, upper=1e6, meaning="natural frequency of the cart")
    cart_damping_ratio: Value = parameter("ζ_c", "1", start=0.1, lower=1e-4, upper=10.0, meaning="damping ratio of the cart")

    def scaled(self, factor: Value) -> "CartRecoil":
        """A cart that much lighter, at the same frequency and damping ratio; as good as immovable for a factor of zero."""
        moves = jnp.asarray(factor) > 0
        return dataclasses.replace(self, cart_mass=jnp.where(moves, self.cart_mass / jnp.where(moves, factor, 1.0), _IMMOVABLE))

    @property
    def fastest_hz(self) -> Value:
        return self.cart_frequency_hz

    def base_displacement(self, own: Own) -> Scalars:
        return own[..., 0]

    def base_acceleration(self, own: Own, push: Scalars) -> Scalars:
        r, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.cart_frequency_hz
        return push / self.cart_mass - omega**2 * r - 2.0 * self.cart_damping_ratio * omega * v

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        return jnp.stack([own[..., 1], self.base_acceleration(own, push)], axis=-1)
