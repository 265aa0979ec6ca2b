"""The physics of an effect: one piece of mechanics, geometry or measurement that the nominal model leaves out.

The same object simulates the effect, stands as a candidate in a diagnosis, and prints itself.

To add one: write a final subclass of `AbstractEffect` that gives `name`, `summary`, `equation`, `source` and its `probe` (how it is
searched for: `vibrojax.effects.probe`), declares its parameters as fields, and implements those of the hooks `force`, `stop_position`,
`stop_velocity`, `stop`, `base`, `base_displacement`, `base_acceleration`, `own_states` with `rates`, `read` and `lateness` through which it
acts (by default each does nothing), `memory` where it is a digital filter, `undone` where it can be inverted without the motion, and
`scaled` where it is not in proportion to its strengths; then import it in `vibrojax/effects/__init__.py`.
"""

import abc
import dataclasses
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from vibrojax.channel_units import UNITS
from vibrojax.contact import AbstractContactLaw
from vibrojax.effects.probe import Probe
from vibrojax.excitation import AbstractBaseMotion
from vibrojax.parameters import DeclaredParameters, Parameter
from vibrojax.shapes import Scalars, Value

Own = Float[Array, "... own"]
"""States of one effect, on the last axis; empty where it has none."""
Reading = Float[Array, " time"]
Readings = dict[str, Reading]
UNIT_OF_CHANNEL = "unit of the channel"
"""Unit of a parameter that is added to a reading; `(unit of the channel)` where it is a factor."""


def unit_in(unit: str, channel: str | None) -> str:
    """Unit of a parameter of an effect on one channel; as it is where there is none.

    Example:
        >>> unit_in("1/(unit of the channel)^2", "cart_displacement"), unit_in("unit of the channel", "cart_acceleration")
        ('1/m^2', 'm/s^2')
    """
    if not channel:
        return unit
    found = UNITS[channel]
    return unit.replace(f"({UNIT_OF_CHANNEL})", found if found.isalpha() else f"({found})").replace(UNIT_OF_CHANNEL, found)


class Motion(eqx.Module):
    """What the rig does at one instant, as an effect sees it; or at many, then with as many leading axes everywhere."""

    t: Scalars
    """s, since the zero of the record's clock."""
    u: Scalars
    """Hammer relative to cart, m."""
    v: Scalars
    """u', m/s."""
    indentation: Scalars
    """Into the stop in front, m; positive in contact."""
    indentation_rate: Scalars
    """m/s."""
    in_contact: Bool[Array, "..."]
    """With whichever stop."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class OwnState:
    """A state of an effect beyond u and u'."""

    name: str
    unit: str
    scale: float
    """Size that it may have at the start of a stretch of record, in its unit; 0 where it has died down by then."""


class AbstractEffect(eqx.Module):
    """One thing that the nominal model leaves out."""

    name: eqx.AbstractClassVar[str]
    """Name in `diagnosis.json` and `model.json`."""
    summary: eqx.AbstractClassVar[str]
    """What it is, as the subject of a sentence: "dry friction in the suspension"."""
    equation: eqx.AbstractClassVar[str]
    """For tables and reports."""
    source: eqx.AbstractClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = DeclaredParameters()  # type: ignore[assignment]
    """Those that the fields declare (`vibrojax.parameters.parameter`), in their order."""
    probe: eqx.AbstractClassVar[Probe]
    """How a diagnosis searches for it."""
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    is_fault: ClassVar[bool] = False
    """Whether it is a fault of the recorder, which the rig knows nothing of."""
    special_cases: ClassVar[tuple[str, ...]] = ()
    """Names of listed effects that it holds as special cases: where one of these suffices, records need not separate the two."""

    def scaled(self, factor: Value) -> "AbstractEffect":
        """The effect at `factor` times its strength; 0 switches it off.

        By default all else stays, and what its probe estimates together is in proportion, or its first parameter.
        """
        strengths = self.probe.parts or (self.parameters[0].field,)
        return dataclasses.replace(self, **{field: factor * getattr(self, field) for field in strengths})

    @property
    def fastest_hz(self) -> Value:
        """Frequency of its own fastest vibration, Hz, that integration steps must follow; 0 for none."""
        return 0.0

    @property
    def switch_speed(self) -> Value | None:
        """Velocity u' over which its force switches where the hammer turns back, m/s; None where it does not switch with u'."""
        return None

    @property
    def damping_needed(self) -> Value:
        """Coefficient of the suspension's viscous damping, N s/m, below which it would drive the motion; 0 where it drives none."""
        return 0.0

    @property
    def record(self) -> str | None:
        """File of the only record in which it acts; None where it acts in all."""
        return None

    @property
    def channel(self) -> str | None:
        """The only channel that it touches, for a fault of one sensor."""
        return None

    def does(self, hook: str) -> bool:
        """Whether it acts through one of the hooks, given by name."""
        return getattr(type(self), hook) is not getattr(AbstractEffect, hook)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Force on the hammer towards the stop, N."""
        return jnp.zeros_like(motion.u)

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        """What it adds to the gap, m."""
        return jnp.zeros_like(t)

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        """Rate of `stop_position`, m/s."""
        return jnp.zeros_like(t)

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        """Law and gap of the stop in front, from those of the nominal model."""
        return law, gap

    @property
    def back_gap(self) -> Value | None:
        """Distance of a second stop behind the hammer at rest, m; None where it makes none."""
        return None

    def base(self, base: AbstractBaseMotion) -> AbstractBaseMotion:
        """Prescribed motion of the cart, from that of the nominal model."""
        return base

    def base_displacement(self, own: Own) -> Scalars:
        """What it adds to the cart's motion, m."""
        return jnp.zeros(own.shape[:-1], own.dtype)

    def base_acceleration(self, own: Own, push: Scalars) -> Scalars:
        """Second derivative of `base_displacement`, m/s^2, under a push of the stop on the hammer, N."""
        return jnp.zeros_like(push)

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """Rates of its own states, under the push of the stop, N, and the hammer's absolute acceleration, m/s^2.

        By default none: the states are the memory of a digital filter at the first sample of a stretch.
        """
        return jnp.zeros_like(own)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """What the recorder shows along a motion, from what an ideal one would; a channel that is not there stays away."""
        return readings

    def undone(self, readings: Readings, t: Float[Array, " time"]) -> Readings:
        """Readings of ideal sensors, from what the recorder shows at times t, s.

        For effects that can be inverted without knowing the motion; by default nothing is undone.
        """
        return readings

    def lateness(self, t: Scalars) -> Scalars:
        """Time by which its channel is late, s: at t it shows what was so much earlier; below zero, what is still to come."""
        return jnp.zeros_like(t)

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """Its own states at the samples of a stretch, (time, own), were a stretch to begin there; from what `read` was given and gave.

        Those that a stretch carries to its end are as in `own`.
        """
        return own


class AbstractChannelFault(AbstractEffect):
    """A fault of the recorder in one channel; it implements `reading`. States of its own are the memory of a filter."""

    is_fault: ClassVar[bool] = True
    of_channel: eqx.AbstractVar[str]
    """Name of the channel; empty for none."""

    @abc.abstractmethod
    def reading(self, value: Reading, motion: Motion, own: Own) -> Reading:
        """What the recorder shows in the channel, from what an ideal one would."""

    @property
    def channel(self) -> str | None:
        return self.of_channel or None

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: self.reading(readings[self.of_channel], motion, own)}

    def memory(self, readings: Readings, shown: Readings, own: Own) -> Own:
        """That of a filter, in the channel's unit: what the channel shows less what goes in."""
        if not self.own_states or self.of_channel not in readings:
            return own
        return (shown[self.of_channel] - readings[self.of_channel])[:, None]
