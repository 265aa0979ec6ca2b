"""What stands for no cause: a force or an error of a reading tabulated over one coordinate of the motion, and a tonal force."""

import dataclasses
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.channel_units import UNITS
from vibrojax.effects.base import AbstractEffect, Motion, Own, Readings
from vibrojax.effects.probe import Probe
from vibrojax.errors import shown
from vibrojax.parameters import Parameter, parameter
from vibrojax.shapes import Scalars, Value

MOST_KNOTS = 16
"""Coefficients that one effect holds: one at each knot, or two where they differ between the directions."""
_CREEP = 1e-3
"""m/s; the change of direction is spread over this either way."""
Values = TypeVar("Values", Array, np.ndarray)


class _Coordinate(NamedTuple):
    symbol: str
    unit: str
    along: Callable[[Motion], Scalars]


_OF_MOTION = {
    "displacement": _Coordinate("u", "m", lambda motion: motion.u),
    "velocity": _Coordinate("u'", "m/s", lambda motion: motion.v),
    "indentation": _Coordinate("delta", "m", lambda motion: motion.indentation),
    "time": _Coordinate("t", "s", lambda motion: motion.t),
}
_READING = "reading"
COORDINATES = (*_OF_MOTION, _READING)
"""Coordinates that a free form may be a function of."""


def hats(
    values: Float[Values, "..."], knots: Sequence[float] | Float[np.ndarray, " knots"], *, vanishing_below: bool
) -> Float[Values, "knots ..."]:
    """Piecewise linear functions of a coordinate, each 1 at its own knot and 0 at all others.

    Beyond the last knot they stay constant, and so they do below the first: their sum is 1 everywhere. NumPy and JAX arrays alike;
    differentiable but at the knots, where the derivative is the mean of those on either side.

    Arguments:
        values: of the coordinate.
        knots: at least two, increasing.
        vanishing_below: whether the first falls to 0 over one spacing below the first knot.

    Example:
        >>> hats(np.array([-0.5, 0.25, 9.0]), (0.0, 1.0), vanishing_below=True).tolist()
        [[0.5, 0.75, 0.0], [0.0, 0.25, 1.0]]
    """
    xp: Any = np if isinstance(values, np.ndarray) else jnp
    spacings = [(float(left), float(right - left)) for left, right in pairwise(knots)]
    if vanishing_below:
        first, width = spacings[0]
        spacings.insert(0, (first - width, width))
    covered = [xp.clip((values - left) / width, 0.0, 1.0) for left, width in spacings]  # share of each spacing that lies below
    if not vanishing_below:
        covered.insert(0, xp.ones_like(values))
    return xp.stack([here - above for here, above in pairwise([*covered, xp.zeros_like(values)])])


def _equation(effect: "FreeForm") -> str:
    """The coordinate that it is a function of."""
    left = f"{effect.of_channel} = value + " if effect.of_channel else "force = "
    of = "value" if effect.coordinate == _READING else _OF_MOTION[effect.coordinate].symbol
    way = ", sign u'" if effect.by_direction else ""
    return f"{left}f({of}{way}), piecewise linear"


def _parameters(effect: "FreeForm") -> tuple[Parameter, ...]:
    """Its coefficients, from the first knot to the last."""
    unit = effect.unit if effect.coordinate == _READING else _OF_MOTION[effect.coordinate].unit
    ways = (", u' > 0", ", u' <= 0") if effect.by_direction else ("",)
    places = [f"at {effect.coordinate} {knot:.3g} {unit}{way}" for knot in effect.knots for way in ways]
    coefficients = zip(effect.coefficients, effect.scales or (1.0,) * len(places), places, strict=True)
    return tuple(
        Parameter(name, f"c_{name[1:]}", effect.unit, start=0.0, lower=-np.inf, scale=scale, meaning=place)
        for name, scale, place in coefficients
    )


class FreeForm(AbstractEffect):
    """A force on the hammer, or an addition to one channel, as a piecewise linear function of one coordinate of the motion.

    value = sum_k c_k hat_k(q), with hats on the knots (`hats`): c_k is the value at knot k, and beyond the ends the value stays what it is
    there. Only as a function of indentation does it fall to zero over one spacing below the first knot: nothing acts far from the stop.
    Where it differs between the directions, c_1, c_3, ... act at the knots while u' > 0, and c_2, c_4, ... while u' <= 0.

    It stands for no cause: it is not listed among `vibrojax.effects.EFFECTS`, and its name is none of a physical effect.

    Arguments:
        coordinate: "displacement" u, "velocity" u', "indentation" delta of the stop in front, "time" t on the record's clock, or, in a
            channel, "reading": what it would show without this.
        knots: increasing, in the coordinate's SI unit; 2 to 16, at most 8 where it differs between the directions.
        of_channel: name of the channel; none for a force.
        by_direction: whether it differs between the directions of u'.
        scales: usual size of each coefficient, for the steps of a fit.
        c1, ..., c16: coefficients, N or the channel's unit; those beyond the knots count for nothing.

    Raises:
        ValueError: the coordinate, the channel, the knots or the number of scales is not one of these.

    Source: C. de Boor, A Practical Guide to Splines (1978), ch. III (broken lines in the basis of hats).

    Example:
        >>> FreeForm(coordinate="velocity", knots=(-0.1, 0.0, 0.1), c1=0.2, c3=-0.2).equation
        "force = f(u'), piecewise linear"
    """

    name: ClassVar[str] = "free_form"
    summary: ClassVar[str] = "a term that no listed effect accounts for"
    equation: ClassVar[str] = property(_equation)  # type: ignore[assignment]
    source: ClassVar[str] = "learned from the records"
    parameters: ClassVar[tuple[Parameter, ...]] = property(_parameters)  # type: ignore[assignment]
    probe: ClassVar[Probe] = Probe(lambda scales: [], either_sign=True)
    """It is learned, not searched for among the listed effects."""

    coordinate: str = eqx.field(static=True)
    knots: tuple[float, ...] = eqx.field(static=True)
    of_channel: str = eqx.field(static=True, default="")
    by_direction: bool = eqx.field(static=True, default=False)
    scales: tuple[float, ...] = eqx.field(static=True, default=())
    c1: Value = 0.0
    c2: Value = 0.0
    c3: Value = 0.0
    c4: Value = 0.0
    c5: Value = 0.0
    c6: Value = 0.0
    c7: Value = 0.0
    c8: Value = 0.0
    c9: Value = 0.0
    c10: Value = 0.0
    c11: Value = 0.0
    c12: Value = 0.0
    c13: Value = 0.0
    c14: Value = 0.0
    c15: Value = 0.0
    c16: Value = 0.0

    def __check_init__(self):
        if self.coordinate not in COORDINATES:
            raise ValueError(f"coordinate {shown(self.coordinate)} is not known: expected one of {', '.join(COORDINATES)}")
        if self.of_channel and self.of_channel not in UNITS:
            raise ValueError(f"channel {shown(self.of_channel)} is not known: expected one of {', '.join(UNITS)}, or none for a force")
        if self.coordinate == _READING and not self.of_channel:
            raise ValueError("a force has no reading: expected a channel beside coordinate 'reading'; name it, or take another coordinate")
        most = MOST_KNOTS // 2 if self.by_direction else MOST_KNOTS
        if not 2 <= len(self.knots) <= most:
            each = ", each with two coefficients" if self.by_direction else ""
            raise ValueError(f"{len(self.knots)} knots: expected 2 to {most}{each}; choose others")
        with np.errstate(all="ignore"):
            spacings = np.diff(np.asarray(self.knots, np.float64))
            usable = (spacings > 0) & np.isfinite(spacings) & np.isfinite(1.0 / spacings)
        if not usable.all():
            raise ValueError(f"knots are {shown(self.knots)}: expected finite numbers, each above the one before; sort them, each once")
        if self.scales and (len(self.scales) != len(self.coefficients) or not all(scale > 0 for scale in self.scales)):
            count = len(self.coefficients)
            raise ValueError(f"scales are {shown(self.scales)}: expected a number above 0 for each of {count} coefficients; or give none")

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of those that act."""
        return tuple(f"c{k}" for k in range(1, len(self.knots) * (2 if self.by_direction else 1) + 1))

    @property
    def switch_speed(self) -> float | None:
        """Of a force that differs between the directions, m/s."""
        return _CREEP if self.by_direction and not self.of_channel else None

    @property
    def unit(self) -> str:
        """Of its value."""
        return UNITS[self.of_channel] if self.of_channel else "N"

    @property
    def channel(self) -> str | None:
        return self.of_channel or None

    def scaled(self, factor: Value) -> "FreeForm":
        return dataclasses.replace(self, **{name: factor * getattr(self, name) for name in self.coefficients})

    def force(self, motion: Motion, own: Own) -> Scalars:
        return jnp.zeros_like(motion.u) if self.of_channel else self._value(_OF_MOTION[self.coordinate].along(motion), motion)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        if self.of_channel not in readings:
            return readings
        ideal = readings[self.of_channel]
        of = ideal if self.coordinate == _READING else _OF_MOTION[self.coordinate].along(motion)
        return readings | {self.of_channel: ideal + self._value(of, motion)}

    def _value(self, of: Scalars, motion: Motion) -> Scalars:
        towards = 0.5 * (1.0 + jnp.tanh(motion.v / _CREEP))
        ways = (towards, 1.0 - towards) if self.by_direction else (jnp.ones_like(of),)
        shapes = [way * hat for hat in hats(of, self.knots, vanishing_below=self.coordinate == "indentation") for way in ways]
        return sum((getattr(self, name) * shape for name, shape in zip(self.coefficients, shapes, strict=True)), jnp.zeros_like(of))


def _tone(effect: "TonalForce") -> str:
    """With its frequency, where that is known."""
    try:
        turn = f"2 pi {float(effect.frequency_hz):.5g} Hz t"
    except TypeError:  # inside a transformation of JAX
        turn = "2 pi f t"
    return f"force = a sin({turn}) + b cos({turn}), a and b differ between records"


class TonalForce(AbstractEffect):
    """A force on the hammer at one frequency, unrelated to its motion; its size and phase differ between records.

    force = a sin(2 pi f t) + b cos(2 pi f t), t on the record's clock. Differentiable everywhere.

    It stands for no cause, as `FreeForm`: a machine next door, a fan, a mode of the floor.

    Arguments:
        frequency_hz: f > 0, Hz.
        sine: a, N.
        cosine: b, N.

    Source: D. J. Ewins, Modal Testing, 2nd edition (2000), chapter 3 (unmeasured excitation).
    """

    name: ClassVar[str] = "tonal_force"
    summary: ClassVar[str] = "a force at one frequency that no listed effect accounts for"
    equation: ClassVar[str] = property(_tone)  # type: ignore[assignment]
    source: ClassVar[str] = "Ewins 2000"
    probe: ClassVar[Probe] = Probe(lambda scales: [], parts=("cosine", "sine"), either_sign=True, is_line=True)
    """A line of the random force, not searched for among the listed effects."""

    frequency_hz: Value = parameter("f_F", "Hz", start=10.0, lower=1e-3, upper=1e5, meaning="frequency of the force")
    sine: Value = parameter("a_F", "N", start=0.0, lower=-np.inf, scale=0.1, per_record=True, meaning="sine part of the force")
    cosine: Value = parameter("b_F", "N", start=0.0, lower=-np.inf, scale=0.1, per_record=True, meaning="cosine part of the force")

    @property
    def fastest_hz(self) -> Value:
        return self.frequency_hz

    def force(self, motion: Motion, own: Own) -> Scalars:
        angle = 2.0 * jnp.pi * self.frequency_hz * motion.t
        return self.sine * jnp.sin(angle) + self.cosine * jnp.cos(angle)
