"""A term that was learned from records because no listed effect explains them."""

import re
from collections.abc import Callable
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from vibrojax.channels import UNITS
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe
from vibrojax.errors import shown
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

MOST_TERMS = 6
"""Terms that one effect can hold."""
MOST_FACTORS = 6
"""Factors that one term can hold."""
LINES = 2
"""Sines of unknown frequency among them."""
_CREEP = 1e-3
"""m/s, m; sign(u') and sign(u) are spread over this either way."""
_MOST_POWER = 9
_PLAIN: dict[str, tuple[Callable[[Motion], Scalars], tuple[int, int]]] = {
    "1": (lambda motion: jnp.ones_like(motion.u), (0, 0)),
    "t": (lambda motion: motion.t, (0, 1)),
    "u": (lambda motion: motion.u, (1, 0)),
    "|u|": (lambda motion: jnp.abs(motion.u), (1, 0)),
    "sign(u)": (lambda motion: jnp.tanh(motion.u / _CREEP), (0, 0)),
    "u'": (lambda motion: motion.v, (1, -1)),
    "|u'|": (lambda motion: jnp.abs(motion.v), (1, -1)),
    "sign(u')": (lambda motion: jnp.tanh(motion.v / _CREEP), (0, 0)),
    "contact": (lambda motion: _where(motion, jnp.ones_like(motion.u)), (0, 0)),
    "delta": (lambda motion: _where(motion, jnp.maximum(motion.indentation, 0.0)), (1, 0)),
    "delta'": (lambda motion: _where(motion, motion.indentation_rate), (1, -1)),
    "|delta'|": (lambda motion: _where(motion, jnp.abs(motion.indentation_rate)), (1, -1)),
}
"""Factor of a term -> its value and its dimension in m and s."""
_SHAPED = ("near", "settled", *(f"sine_{line}" for line in range(1, LINES + 1)))
"""Factors without dimension that have an estimated number of their own."""
_FACTOR = re.compile(r"(?P<base>.+?)(\^(?P<power>\d))?$")


def _equation(effect: "FreeForm") -> str:
    """The sum, in symbols."""
    left = f"{effect.of_channel} = value + " if effect.of_channel else "force = "
    return left + " + ".join(f"c{k}" if term == "1" else f"c{k} {term}" for k, term in enumerate(effect.terms, start=1))


def _parameters(effect: "FreeForm") -> tuple[Parameter, ...]:
    """Those that its terms have: coefficients, then frequencies and lengths, then phases."""
    scales = effect.scales or (1.0,) * len(effect.terms)
    coefficients = tuple(
        Parameter(
            name=f"c{k}",
            field=f"c{k}",
            symbol=f"c_{k}",
            unit=unit_over(effect.unit, term),
            start=0.0,
            lower=-np.inf,
            scale=scale,
            logarithmic=False,
            meaning=f"factor of {term}",
        )
        for k, (term, scale) in enumerate(zip(effect.terms, scales, strict=True), start=1)
    )
    used = {base for term in effect.terms for base, _ in factors(term)}
    return coefficients + tuple(p for base, p in _ESTIMATED if base in used)


class FreeForm(AbstractEffect):
    """A sum of a few terms in the coordinates of the motion, as a force on the hammer or as an addition to one channel.

    force = c1 term_1 + c2 term_2 + ...; each term is a product of factors, written with blanks between them ("u^2 u'", "t u"):

    - 1, t, u, |u|, sign(u), u', |u'|, sign(u'), and in contact alone: contact (1), delta, delta', |delta'|; each with a power if need be;
    - near = 1 / (1 + (distance to the stop) / d)^2, for what acts close to the stop;
    - settled = 1 - exp(-t / tau), t on the record's clock;
    - sine_1, sine_2 = sin(2 pi f t + p), its phase another in every record.

    It stands for no cause: it is not listed among `vibrojax.effects.EFFECTS`, and its name is none of a physical effect.

    Arguments:
        terms: at most 6.
        of_channel: name of the channel; none for a force.
        scales: usual size of each coefficient, for the steps of a fit.
        c1, ..., c6: coefficients, N (or the channel's unit) over the term's unit.
        f1_hz, f2_hz: frequencies, Hz.
        p1, p2: phases, rad.
        d: reach, m > 0.
        tau: time constant, s > 0.

    Raises:
        ValueError: a term is not made of these factors, or there are too many.

    Example:
        >>> FreeForm(terms=("u^3", "|u| u'"), c1=-2e5, c2=-30.0).equation
        "force = c1 u^3 + c2 |u| u'"
    """

    name: ClassVar[str] = "free_form"
    summary: ClassVar[str] = "a term that no listed effect accounts for"
    equation: ClassVar[str] = property(_equation)  # type: ignore[assignment]
    source: ClassVar[str] = "learned from the records"
    parameters: ClassVar[tuple[Parameter, ...]] = property(_parameters)  # type: ignore[assignment]
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(lambda scales: [], either_sign=True)
    """It is learned, not searched for among the listed effects."""

    terms: tuple[str, ...] = eqx.field(static=True)
    of_channel: str = eqx.field(static=True, default="")
    scales: tuple[float, ...] = eqx.field(static=True, default=())
    c1: Value = 0.0
    c2: Value = 0.0
    c3: Value = 0.0
    c4: Value = 0.0
    c5: Value = 0.0
    c6: Value = 0.0
    f1_hz: Value = 10.0
    f2_hz: Value = 10.0
    p1: Value = 0.0
    p2: Value = 0.0
    d: Value = 1e-3
    tau: Value = 1.0

    @property
    def switch_speed(self) -> float | None:
        """Of sign(u'), where a term holds it."""
        return _CREEP if any("sign(u')" in term for term in self.terms) else None

    def __check_init__(self):
        if not 1 <= len(self.terms) <= MOST_TERMS:
            raise ValueError(f"{len(self.terms)} terms: expected 1 to {MOST_TERMS}")
        if len(set(self.terms)) < len(self.terms):
            raise ValueError(f"a term is given twice among {shown(self.terms)}; add up their coefficients")
        for term in self.terms:
            factors(term)

    def scaled(self, factor: Value) -> "FreeForm":
        """All coefficients in proportion."""
        names = [f"c{k}" for k in range(1, MOST_TERMS + 1)]
        return eqx.tree_at(lambda e: [getattr(e, n) for n in names], self, [factor * getattr(self, n) for n in names])

    @property
    def unit(self) -> str:
        """Of the sum."""
        return UNITS[self.of_channel] if self.of_channel else "N"

    @property
    def channel(self) -> str | None:
        """To which it is added, if it is no force."""
        return self.of_channel or None

    @property
    def fastest_hz(self) -> Value:
        """Highest frequency of its sines, Hz."""
        used = {base for term in self.terms for base, _ in factors(term)}
        return max([getattr(self, f"f{k}_hz") for k in range(1, LINES + 1) if f"sine_{k}" in used], default=0.0)

    def total(self, motion: Motion) -> Scalars:
        """Sum of the terms along a motion."""
        whole = jnp.zeros_like(motion.u)
        for k, term in enumerate(self.terms, start=1):
            whole = whole + getattr(self, f"c{k}") * self.value(term, motion)
        return whole

    def value(self, term: str, motion: Motion) -> Scalars:
        """One term, without its coefficient."""
        found = jnp.ones_like(motion.u)
        for base, power in factors(term):
            found = found * self._factor(base, motion) ** power
        return found

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Towards the stop, N."""
        return jnp.zeros_like(motion.u) if self.of_channel else self.total(motion)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """Its channel with the terms on it."""
        if self.of_channel not in readings:
            return readings
        return readings | {self.of_channel: readings[self.of_channel] + self.total(motion)}

    def _factor(self, base: str, motion: Motion) -> Scalars:
        if base in _PLAIN:
            return _PLAIN[base][0](motion)
        if base == "near":
            return (1.0 + jnp.maximum(-motion.indentation, 0.0) / self.d) ** -2
        if base == "settled":
            return 1.0 - jnp.exp(-jnp.maximum(motion.t, 0.0) / self.tau)
        line = base.removeprefix("sine_")
        return jnp.sin(2.0 * jnp.pi * getattr(self, f"f{line}_hz") * motion.t + getattr(self, f"p{line}"))


def _shaped(field: str, symbol: str, unit: str, meaning: str, start: float, lower: float, upper: float) -> Parameter:
    return Parameter(name=field, field=field, symbol=symbol, unit=unit, start=start, lower=lower, upper=upper, meaning=meaning)


def _phase(line: int) -> Parameter:
    return Parameter(
        name=f"p{line}",
        field=f"p{line}",
        symbol=f"p_{line}",
        unit="rad",
        start=0.0,
        lower=-np.inf,
        logarithmic=False,
        per_record=True,
        meaning=f"phase of sine_{line}",
    )


_ESTIMATED: tuple[tuple[str, Parameter], ...] = (
    ("near", _shaped("d", "d", "m", "reach", 1e-3, 1e-6, 10.0)),
    ("settled", _shaped("tau", "tau", "s", "time constant", 1.0, 1e-3, 1e4)),
    *((f"sine_{k}", _shaped(f"f{k}_hz", f"f_{k}", "Hz", f"frequency of sine_{k}", 10.0, 1e-3, 1e5)) for k in range(1, LINES + 1)),
    *((f"sine_{k}", _phase(k)) for k in range(1, LINES + 1)),
)
"""Numbers that come with a factor."""


def factors(term: str) -> list[tuple[str, int]]:
    """Factors of a term with their powers.

    Raises:
        ValueError: one is not known.

    Example:
        >>> factors("u^2 u'")
        [('u', 2), ("u'", 1)]
    """
    found = []
    for text in term.split():
        match = _FACTOR.fullmatch(text)
        base, power = (match["base"], int(match["power"] or 1)) if match else (text, 1)
        if base not in _PLAIN and base not in _SHAPED or not 1 <= power <= _MOST_POWER:
            raise ValueError(
                f"factor {shown(text)} is not known: expected one of {', '.join([*_PLAIN, *_SHAPED])}, with a power if need be"
            )
        found.append((base, power))
        if len(found) > MOST_FACTORS:
            raise ValueError(f"a term has more than {MOST_FACTORS} factors: expected fewer; write a power where one repeats")
    if not found:
        raise ValueError('a term is empty: expected factors, as in "u^2 u\'"')
    return found


def unit_over(unit: str, term: str) -> str:
    """Unit of a term's coefficient.

    Example:
        >>> unit_over("N", "u^2 u'"), unit_over("N", "1"), unit_over("m", "t")
        ('N s/m^3', 'N', 'm/s')
    """
    metres = sum(_PLAIN[base][1][0] * power for base, power in factors(term) if base in _PLAIN)
    seconds = sum(_PLAIN[base][1][1] * power for base, power in factors(term) if base in _PLAIN)
    above = [_power(name, -count) for name, count in (("m", metres), ("s", seconds)) if count < 0]
    below = [_power(name, count) for name, count in (("m", metres), ("s", seconds)) if count > 0]
    over = "" if not below else "/" + (below[0] if len(below) == 1 else f"({' '.join(below)})")
    return " ".join([unit, *above]) + over


def _power(name: str, count: int) -> str:
    return name if count == 1 else f"{name}^{count}"


def _where(motion: Motion, value: Scalars) -> Scalars:
    """In contact, else 0."""
    return jnp.where(motion.in_contact, value, jnp.zeros_like(value))
