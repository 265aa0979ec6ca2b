"""What an effect is: one piece of physics, geometry or measurement that the nominal model leaves out.

The same object simulates the effect, stands as a candidate when the program looks for what is missing, and prints itself.

To add one: write a file with a final subclass of `AbstractEffect` that gives `name`, `summary`, `equation`, `source` and `parameters`
and implements `probes`, `scaled` and those of the hooks `force`, `stop_position`, `stop_velocity`, `stop`, `base`, `base_displacement`,
`base_acceleration`, `rates` and `read` through which it acts (the others say that it does not), then list it in
`vibrojax/effects/__init__.py`.
"""

import abc
import dataclasses
import math
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from vibrojax.contact import AbstractContactLaw
from vibrojax.excitation import AbstractBaseMotion
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

Own = Float[Array, "... own"]
"""States of one effect, on the last axis; empty where it has none."""
Readings = dict[str, Float[Array, " time"]]
UNIT_OF_CHANNEL = "unit of the channel"
"""Unit of a parameter that is added to a reading."""
_SOFTEST = 0.7
"""Lowest frequency of probes over f_n."""


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
    carried: bool = True
    """Whether it ends a stretch of record as it begins the next one."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Facts:
    """What the records show before any candidate is tried: sizes from which candidates take their strengths and grids, SI.

    Attributes:
        mass: of the hammer, kg.
        f_n: natural frequency, Hz; 0 without a spring.
        omega_exc: highest excitation frequency, rad/s; 0 where the cart is at rest.
        drives: all excitation frequencies, rad/s.
        gaps: as set, by record file, m.
        clock: first and last time stamp by record file, s.
        contacts: first and last time stamp of each contact with the stop, s, by record file.
        channels: recorded and fitted ones.
        noise: standard deviation by channel.
        amplitude: largest |u|, m.
        lowest: least u, m.
        speed: largest |u'|, m/s.
        force: largest impact force, N; 0 without impacts.
        deepest: largest indentation, m; 0 without impacts.
        contact_time: of an impact at that speed, s; NaN without impacts, and where the contact law gives them no duration.
        ceilings: by channel, the value at which its peaks are cut off; absent where they are not.
        lines: by channel, frequencies of the strongest lines in the residual, Hz, strongest first.
        lags: by channel, delay against every other as the records show it without a model, s, above zero where it comes late; absent where
            it agrees with one of them.
        sampling: shortest interval, s.
        law: the contact law as fitted.
    """

    mass: float
    f_n: float
    omega_exc: float
    drives: tuple[float, ...]
    gaps: Mapping[str, float]
    clock: Mapping[str, tuple[float, float]]
    contacts: Mapping[str, tuple[tuple[float, float], ...]]
    channels: tuple[str, ...]
    noise: Mapping[str, float]
    amplitude: float
    lowest: float
    speed: float
    force: float
    deepest: float
    contact_time: float
    ceilings: Mapping[str, float]
    lines: Mapping[str, tuple[float, ...]]
    lags: Mapping[str, float]
    sampling: float
    law: AbstractContactLaw

    @property
    def band(self) -> tuple[float, float]:
        """From the frequency of which the longest record holds three periods to somewhat below Nyquist's, Hz."""
        return 3.0 / max(last - first for first, last in self.clock.values()), 0.4 / self.sampling

    def frequencies(self, apart: float, highest: float = math.inf) -> tuple[float, ...]:
        """Grid of frequencies that the records can show, from somewhat below f_n to a highest one, each `apart` times the one before, Hz.

        What hangs much softer than the hammer does next to nothing.
        """
        low, high = max(self.band[0], _SOFTEST * self.f_n), min(self.band[1], highest)
        if low > high:
            return ()
        count = 1 + math.ceil(math.log(high / low) / math.log(apart))
        return tuple(np.geomspace(low, high, count).tolist())

    @property
    def flight_force(self) -> float:
        """Size of the forces in flight, m v^2 / A of the largest speed and amplitude, N: k A of an oscillator, and none without motion."""
        return self.mass * self.speed**2 / self.amplitude if self.amplitude > 0 else 0.0


class AbstractEffect(eqx.Module):
    """One thing that the nominal model leaves out."""

    name: eqx.AbstractClassVar[str]
    """Name in `diagnosis.json` and `model.json`."""
    summary: eqx.AbstractClassVar[str]
    """What it is, as the subject of a sentence: "dry friction in the suspension"."""
    equation: eqx.AbstractClassVar[str]
    """For tables and reports."""
    source: eqx.AbstractClassVar[str]
    parameters: eqx.AbstractClassVar[tuple[Parameter, ...]]
    own_states: eqx.AbstractClassVar[tuple[OwnState, ...]]

    @abc.abstractmethod
    def probes(self, facts: Facts) -> tuple[tuple["AbstractEffect", ...], ...]:
        """Candidates: each a tuple of effects whose strengths are estimated together (sine and cosine of a line, say).

        Strengths are finite and plausible; what does not enter linearly runs over a grid. Called on any instance.
        """

    @abc.abstractmethod
    def scaled(self, factor: Value) -> "AbstractEffect":
        """The effect at `factor` times its strength; 0 switches it off. Two effects of one candidate are summed by `merged`."""

    def merged(self, other: "AbstractEffect") -> "AbstractEffect":
        """Sum of two effects of one candidate."""
        raise TypeError(f"{self.name} has one strength")

    @property
    def one_signed(self) -> bool:
        """Whether a negative strength is impossible."""
        return True

    @property
    def looked_at(self) -> int:
        """How many possibilities `probes` had looked at for each candidate that it proposes."""
        return 1

    @property
    def tries(self) -> int:
        """How many of its probes, the most promising first, are refitted: more than one where a promise says little of where to begin."""
        return 1

    def other_places(self, facts: Facts) -> tuple["AbstractEffect", ...]:
        """Where what is searched for may be instead, near its place, and a fit can move it from there; by default none."""
        return ()

    @property
    def fastest_hz(self) -> Value:
        """Frequency of its own fastest vibration, Hz, that integration steps must follow; 0 for none."""
        return 0.0

    @property
    def looks_ahead(self) -> Value:
        """Time after an instant up to which the motion is read at that instant, s: windows are integrated so much further, if padded."""
        return 0.0

    @property
    def record(self) -> str | None:
        """File of the only record in which it acts; None where it acts in all."""
        return None

    @property
    def channel(self) -> str | None:
        """The only channel that it touches, for a fault of one sensor."""
        return None

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
    def is_fault(self) -> bool:
        """Whether it is a fault of the recorder, which the rig knows nothing of."""
        return False

    @property
    def is_delay(self) -> bool:
        """Whether it makes its channel late or early, so that a delay that the records show is its own."""
        return False

    @property
    def is_stop(self) -> bool:
        """Whether it is a stop through which the nominal motion passes, so that no derivative tells what it would do."""
        return False

    def shown_by(self, facts: Facts) -> bool:
        """Whether the records show just this without a model, so that it is tried whatever it promises beside one that may have bent."""
        return False

    @property
    def in_loops(self) -> bool:
        """Whether the loops of force against indentation show it so well that a fit should also begin from what they tell."""
        return False

    @property
    def place(self) -> str:
        """Name of the parameter that says where it begins, if to know that is to know the effect, however strong it is; else empty.

        Effects with `is_stop` are known without.
        """
        return ""

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
        """Rates of its own states, under the push of the stop, N, and the hammer's absolute acceleration, m/s^2."""
        return own

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """What the recorder shows along a motion, from what an ideal one would; a channel that is not there stays away."""
        return readings
