"""A drive whose frequency changes while the record runs."""

import dataclasses
from typing import ClassVar

import numpy as np

from vibrojax.effects.base import AbstractEffect, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.excitation import AbstractBaseMotion, SampledMotion
from vibrojax.parameters import Parameter
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
        """At the time that the drive has reached, m."""
        return self.motion.displacement(self._reached(t))

    def velocity(self, t: Scalars) -> Scalars:
        """By the chain rule, m/s."""
        return self.motion.velocity(self._reached(t)) * (1.0 + self.rate * t)

    def acceleration(self, t: Scalars) -> Scalars:
        """By the chain rule, m/s^2."""
        reached = self._reached(t)
        return self.motion.acceleration(reached) * (1.0 + self.rate * t) ** 2 + self.motion.velocity(reached) * self.rate

    def _reached(self, t: Scalars) -> Scalars:
        return t * (1.0 + 0.5 * self.rate * t)


def _candidates(scales: ProbeScales) -> list["FrequencyDrift"]:
    """A twentieth of a radian by the end of the longest record."""
    if scales.omega_exc == 0 or scales.latest == 0:
        return []
    return [FrequencyDrift(2.0 * _PROBE_PHASE / (scales.omega_exc * scales.latest**2))]


class FrequencyDrift(AbstractEffect):
    """A drive that speeds up or slows down steadily from the zero of the record's clock.

    y = A0 sin(Omega (t + rate t^2 / 2) + base_phase): the frequency is f (1 + rate t). A cart whose motion was measured stays as it is.

    Arguments:
        drift_rate: 1/s.

    Source: a linear sweep; D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 3.
    """

    name: ClassVar[str] = "frequency_drift"
    summary: ClassVar[str] = "a drive whose frequency drifts during a record"
    equation: ClassVar[str] = "f(t) = f (1 + r t)"
    source: ClassVar[str] = "Ewins 2000"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="drift_rate",
            field="drift_rate",
            symbol="r",
            unit="1/s",
            start=1e-3,
            lower=-np.inf,
            scale=1e-3,
            logarithmic=False,
            meaning="relative change of the frequency per second",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, either_sign=True)

    drift_rate: Value

    def scaled(self, factor: Value) -> "FrequencyDrift":
        """Rate in proportion."""
        return dataclasses.replace(self, drift_rate=factor * self.drift_rate)

    def base(self, base: AbstractBaseMotion) -> AbstractBaseMotion:
        """The cart with the drifting drive."""
        return base if isinstance(base, SampledMotion) else DriftingMotion(motion=base, rate=self.drift_rate)
