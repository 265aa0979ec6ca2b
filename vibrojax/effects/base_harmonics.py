"""A cart whose motion is not a pure sine."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax import smooth
from vibrojax.effects.base import AbstractEffect, OwnState
from vibrojax.effects.frequency_drift import DriftingMotion
from vibrojax.effects.probe import Probe
from vibrojax.excitation import AbstractBaseMotion, Harmonic
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_PROBE = 0.01


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
        """Sum of the lines, m."""
        (s1, s2, s3), (_, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        return self.sine.base_amplitude * (s1 + a2 * s2 + b2 * c2 + a3 * s3 + b3 * c3)

    def velocity(self, t: Scalars) -> Scalars:
        """First derivative, m/s."""
        (_, s2, s3), (c1, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        slope = c1 + 2.0 * (a2 * c2 - b2 * s2) + 3.0 * (a3 * c3 - b3 * s3)
        return self.sine.base_amplitude * 2.0 * jnp.pi * self.sine.frequency_hz * slope

    def acceleration(self, t: Scalars) -> Scalars:
        """Second derivative, m/s^2."""
        (s1, s2, s3), (_, c2, c3) = self._lines(t)
        (a2, b2), (a3, b3) = self.second, self.third
        bend = s1 + 4.0 * (a2 * s2 + b2 * c2) + 9.0 * (a3 * s3 + b3 * c3)
        return -self.sine.base_amplitude * (2.0 * jnp.pi * self.sine.frequency_hz) ** 2 * bend

    def _lines(self, t: Scalars):
        """Sines and cosines of a, 2a and 3a."""
        angle = 2.0 * jnp.pi * self.sine.frequency_hz * t + self.sine.base_phase
        s, c = smooth.sine(angle), smooth.cosine(angle)
        return (s, 2.0 * s * c, s * (3.0 - 4.0 * s * s)), (c, 1.0 - 2.0 * s * s, c * (4.0 * c * c - 3.0))


def _coefficient(name: str, symbol: str, meaning: str) -> Parameter:
    return Parameter(
        name=name, field=name, symbol=symbol, unit="1", start=_PROBE, lower=-np.inf, scale=_PROBE, logarithmic=False, meaning=meaning
    )


class BaseHarmonics(AbstractEffect):
    """A drive with a second and a third harmonic, relative to the first and alike in all records.

    y = A0 [sin a + s_2 sin 2a + c_2 cos 2a + s_3 sin 3a + c_3 cos 3a],  a = Omega t + base_phase. A cart whose motion was measured stays
    as it is. Differentiable everywhere.

    Arguments:
        second_sine: s_2, 1.
        second_cosine: c_2, 1.
        third_sine: s_3, 1.
        third_cosine: c_3, 1.

    Source: J. Fourier, Theorie analytique de la chaleur (1822).
    """

    name: ClassVar[str] = "base_harmonics"
    summary: ClassVar[str] = "a motion of the cart that is not a pure sine"
    equation: ClassVar[str] = "y = A0 [sin a + s_2 sin 2a + c_2 cos 2a + s_3 sin 3a + c_3 cos 3a],  a = Omega t + phase"
    source: ClassVar[str] = "Fourier 1822"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        _coefficient("second_sine", "s_2", "second harmonic, sine"),
        _coefficient("second_cosine", "c_2", "second harmonic, cosine"),
        _coefficient("third_sine", "s_3", "third harmonic, sine"),
        _coefficient("third_cosine", "c_3", "third harmonic, cosine"),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [BaseHarmonics(_PROBE, _PROBE, _PROBE, _PROBE)] if scales.omega_exc else [],
        parts=("second_sine", "second_cosine", "third_sine", "third_cosine"),
        either_sign=True,
    )
    """A hundredth in each of the four lines, estimated together."""

    second_sine: Value
    second_cosine: Value
    third_sine: Value
    third_cosine: Value

    def scaled(self, factor: Value) -> "BaseHarmonics":
        """All lines in proportion."""
        return BaseHarmonics(*(factor * part for part in self._coefficients()))

    def base(self, base: AbstractBaseMotion) -> AbstractBaseMotion:
        """The sine with its harmonics."""
        if isinstance(base, DriftingMotion):
            return dataclasses.replace(base, motion=self.base(base.motion))
        if not isinstance(base, Harmonic):
            return base
        a2, b2, a3, b3 = self._coefficients()
        return ImpureHarmonic(sine=base, second=(a2, b2), third=(a3, b3))

    def _coefficients(self) -> tuple[Value, ...]:
        return self.second_sine, self.second_cosine, self.third_sine, self.third_cosine
