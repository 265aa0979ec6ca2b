"""A force on the hammer that the user writes as a formula of the motion."""

import dataclasses
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from vibrojax.effects import EFFECTS
from vibrojax.effects.base import AbstractEffect, Motion, Own
from vibrojax.effects.free_form import FreeForm, TonalForce
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.errors import InputError, shown
from vibrojax.formula import CREEP, MOTION, evaluated, read_formula, unit_of
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_EXPONENTS = (1.0, 0.5, 1.5, 2.0, 3.0)
"""First values of an exponent that has no start, the first where only one is wanted."""
_PARTS_OF_SCALE = (0.3, 0.03, 0.1, 1.0)
"""First values of any other parameter that has no start, over the size of its unit in the records, the first where only one is wanted."""
_MOST_CANDIDATES = 64
_REFERENCE = {"amplitude": 1e-3, "speed": 0.1, "force": 1.0, "time": 10.0}
"""m, m/s, N, s: a motion on which a formula is tried when it is read, before any record."""
_STEP, _ALIKE = 1e-4, 1e-7
"""Relative step of central differences by the parameters, and the least singular value of their directions below which two are one:
differences leave 1e-8, and a tanh over its hundredth part 1e-5."""


def _along(motion: Motion) -> dict[str, Any]:
    return {"u": motion.u, "u_dot": motion.v, "t": motion.t, "delta": motion.indentation, "delta_dot": motion.indentation_rate}


def _points(amplitude: float, speed: float, latest: float, deepest: float) -> dict[str, np.ndarray]:
    """Points all over a motion of this size, zeros included."""
    part = np.linspace(-1.0, 1.0, 5)
    axes = (amplitude * part, speed * part, latest * np.array([0.0, 0.37, 1.0]), np.unique([-amplitude, 0.0, 0.5 * deepest, deepest]))
    u, v, t, delta = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    return {"u": u, "u_dot": v, "t": t, "delta": delta, "delta_dot": v}


def _parameters(effect: "Formula") -> tuple[Parameter, ...]:
    """One for each name in the formula that is no part of the motion."""
    read, found = read_formula(effect.formula), []
    for place, name in enumerate(read.names, start=1):
        options: dict[str, Any] = {"lower": -np.inf, "logarithmic": False, "start": 1.0, "meaning": f"parameter of {effect.name}"}
        if name in read.strengths:
            options |= {"start": 0.0, "meaning": f"strength of {effect.name}"}
        elif name in read.exponents:
            options |= {"lower": 0.05, "upper": 6.0, "logarithmic": True, "meaning": f"exponent in {effect.name}"}
        elif name in read.divisors:
            options |= {"lower": 1e-12, "logarithmic": True, "meaning": f"divisor in {effect.name}"}
        found.append(Parameter(name=name, field=f"p{place}", symbol=name, unit=unit_of(read.powers[name]), **options))
    return tuple(found)


def _probe(effect: "Formula") -> Probe["Formula"]:
    """Its strengths are estimated together, beside every combination of the first values of its other parameters."""
    strengths = tuple(effect.field(name) for name in read_formula(effect.formula).strengths)
    return Probe(lambda scales: _candidates(effect, scales), parts=strengths if len(strengths) > 1 else (), either_sign=True)


def _first_values(effect: "Formula", amplitude: float, speed: float, force: float) -> Iterator[dict[str, float]]:
    """First values of all parameters but the strengths, the most plausible ones first."""
    read, given = read_formula(effect.formula), dict(effect.starts)
    grids: dict[str, tuple[float, ...]] = {}
    for name in read.names:
        if name in read.strengths:
            continue
        size = 1.0
        if (powers := read.powers[name]) is not None:
            size = force ** powers[0] * amplitude ** powers[1] * (amplitude / speed) ** powers[2]
        grid = _EXPONENTS if name in read.exponents else tuple(size * part for part in _PARTS_OF_SCALE)
        grids[name] = (given[name],) if name in given else grid
    while math.prod(map(len, grids.values())) > _MOST_CANDIDATES:
        longest = max(grids, key=lambda name: len(grids[name]))
        grids[longest] = grids[longest][:-1]
    return (dict(zip(grids, values, strict=True)) for values in itertools.product(*grids.values()))


def _candidates(effect: "Formula", scales: ProbeScales) -> Iterator["Formula"]:
    """At the largest motion, each strength a hundredth of the forces in flight.

    Raises:
        InputError: the formula is no finite force on the motion of the records, or none at all.
    """
    read = read_formula(effect.formula)
    if not scales.flight_force > 0.0:
        return
    points = _points(scales.amplitude, scales.speed, scales.latest, scales.deepest)
    for others in _first_values(effect, scales.amplitude, scales.speed, scales.flight_force):
        strengths = {}
        for name in read.strengths:
            with np.errstate(all="ignore"):
                force = evaluated(read.tree, points | dict.fromkeys(read.strengths, 0.0) | {name: 1.0} | others, np, read.of_velocity)
            largest = float(np.max(np.abs(force)))
            if not (math.isfinite(largest) and largest > 0.0):
                what = "is zero all over" if largest == 0.0 else "is not finite everywhere in"
                raise InputError(
                    f"formula {shown(effect.formula)} {what} the motion of these records (|u| up to {scales.amplitude:.3g} m, "
                    f"|u_dot| up to {scales.speed:.3g} m/s): expected a force there; guard it, or give other first values with --start"
                )
            strengths[name] = 0.01 * scales.flight_force / largest
        fields = {effect.field(name): value for name, value in (others | strengths).items()}
        yield dataclasses.replace(effect, starts=(), **fields)


class Formula(AbstractEffect):
    """A force on the hammer as a formula of the motion, with parameters that are estimated.

    force = formula, N, positive towards the stop (`vibrojax.contact` states the sign). Symbols: u (m, hammer relative to cart) and u_dot
    (m/s), both growing towards the stop; delta (m, indentation into the stop, below zero away from it) and delta_dot (m/s); t (s, on the
    record's clock); pi. Functions: abs, sign, sqrt, exp, log, sin, cos, tanh, min, max. Every other name is a parameter. Strengths, to
    which all of the force is proportional, are needed; their units follow from the formula, "SI" where it leaves them open.

    Differentiable where the formula is. The derivative of a power of zero is taken as zero, and sign() of a velocity is
    tanh(velocity / 0.5 mm/s), as in dry friction.

    Arguments:
        formula: such as "-a*u_dot*abs(u_dot)"; + - * / ** and parentheses. It is parsed against a list of operations; nothing is executed.
        label: its name; the formula itself where empty.
        starts: first values by name, of parameters that are no strengths; only the search uses them.
        p1, ..., p8: values of the parameters in the order in which the formula names them, SI; those beyond count for nothing.

    Raises:
        InputError: the formula cannot be read, or names what a formula cannot hold; the message says where.

    Example:
        >>> drag = Formula("-a*u_dot*abs(u_dot)", p1=3.0)
        >>> [(p.name, p.unit) for p in drag.parameters]
        [('a', 'N s^2/m^2')]
    """

    name: ClassVar[str] = property(lambda one: one.label or one.formula)  # type: ignore[assignment]
    summary: ClassVar[str] = property(lambda one: "the force " + (f"{one.label} = " if one.label else "") + one.formula)  # type: ignore[assignment]
    equation: ClassVar[str] = property(lambda one: f"force = {one.formula.replace('**', '^')}")  # type: ignore[assignment]
    source: ClassVar[str] = "given by the user"
    parameters: ClassVar[tuple[Parameter, ...]] = property(_parameters)  # type: ignore[assignment]
    probe: ClassVar[Probe] = property(_probe)  # type: ignore[assignment]

    formula: str = eqx.field(static=True)
    label: str = eqx.field(static=True, default="")
    starts: tuple[tuple[str, float], ...] = eqx.field(static=True, default=())
    p1: Value = 0.0
    p2: Value = 0.0
    p3: Value = 0.0
    p4: Value = 0.0
    p5: Value = 0.0
    p6: Value = 0.0
    p7: Value = 0.0
    p8: Value = 0.0

    def __check_init__(self):
        if self.label and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,39}", self.label):
            raise InputError(
                f"{shown(self.label)} is no name of a term: expected a letter, then at most 39 letters, digits and _; rename it"
            )
        if self.label in (*EFFECTS, FreeForm.name, TonalForce.name):
            raise InputError(f"{self.label!r} is the name of a listed effect: expected another for a term; rename it")
        read_formula(self.formula)

    @property
    def strengths(self) -> tuple[str, ...]:
        """Names of the parameters to which the force is proportional."""
        return read_formula(self.formula).strengths

    @property
    def switch_speed(self) -> float | None:
        """Of a formula with the sign of a velocity, m/s."""
        return CREEP if read_formula(self.formula).of_velocity else None

    def field(self, name: str) -> str:
        """Attribute that holds a parameter."""
        return f"p{read_formula(self.formula).names.index(name) + 1}"

    def scaled(self, factor: Value) -> "Formula":
        fields = [self.field(name) for name in self.strengths]
        return dataclasses.replace(self, **{field: factor * getattr(self, field) for field in fields})

    def force(self, motion: Motion, own: Own) -> Scalars:
        read = read_formula(self.formula)
        values = {name: getattr(self, f"p{place}") for place, name in enumerate(read.names, start=1)}
        return jnp.zeros_like(motion.u) + evaluated(read.tree, _along(motion) | values, jnp, read.of_velocity)


def terms(texts: Sequence[str], starts: Mapping[str, float] | None = None) -> tuple[Formula, ...]:
    """Terms as a user gives them, checked on a motion of usual size before any record is read.

    Args:
        texts: each a formula, or NAME=formula.
        starts: first values by the name of a parameter, SI; of exponents and the like, since strengths need none.

    Raises:
        InputError: a formula cannot be used, a name is taken or given twice, a start is of no use.

    Example:
        >>> [term.name for term in terms(["drag=-a*abs(u_dot)**p*sign(u_dot)", "-b*u**3"], {"p": 1.5})]
        ['drag', '-b*u**3']
    """
    if isinstance(texts, str):
        raise InputError(f"{texts!r} is one text: expected a list of formulas, such as [{texts!r}]")
    given, found = dict(starts or {}), list[Formula]()
    for text in texts:
        label, equals, formula = text.partition("=")
        label, formula = (label.strip(), formula) if equals else ("", text)
        if equals and not label:
            raise InputError(f"term {shown(text)} has no name before =: expected NAME=formula, or a formula alone; name it")
        term = Formula(" ".join(formula.split()), label)
        own = [p.name for p in term.parameters]
        term = dataclasses.replace(term, starts=tuple((name, float(given[name])) for name in own if name in given))
        if any(term.name == other.name for other in found):
            raise InputError(f"two terms are called {shown(term.name)}: expected a name of its own for each; write NAME=formula")
        found.append(term)
    for name, value in given.items():
        holders = [term for term in found if any(p.name == name for p in term.parameters)]
        if not holders:
            known = [p.name for term in found for p in term.parameters if p.name not in term.strengths]
            raise InputError(f"start of {name}: no term has such a parameter; expected one of {', '.join(known) or 'none'}; correct it")
        if any(name in term.strengths for term in holders):
            raise InputError(f"start of {name}: it multiplies the term, and its first value comes from the records; leave the start out")
        for p in (p for term in holders for p in term.parameters if p.name == name):
            if not (math.isfinite(value) and p.lower <= value <= p.upper):
                raise InputError(f"start of {name} is {value:g}: expected a number from {p.lower:g} to {p.upper:g}; correct it")
    for term in found:
        _check_on_a_motion(term)
    return tuple(found)


def _check_on_a_motion(term: Formula) -> None:
    """Refuse a formula that is not finite on a motion of usual size, or whose parameters no motion distinguishes."""
    read, size = read_formula(term.formula), _REFERENCE
    points = _points(size["amplitude"], size["speed"], size["time"], 0.1 * size["amplitude"])
    values = dict.fromkeys(read.strengths, 1.0) | next(_first_values(term, size["amplitude"], size["speed"], size["force"]))

    def force(**changed: float) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.broadcast_to(evaluated(read.tree, points | values | changed, np, read.of_velocity), points["u"].shape)

    if (wrong := np.flatnonzero(~np.isfinite(force()))).size:
        place = ", ".join(f"{name} = {points[name][wrong[0]]:g}" for name in MOTION if re.search(rf"\b{name}\b", term.formula))
        remedy = "guard it, as in abs(u_dot)**p for a power and log(abs(u) + 1e-6) for a logarithm"
        raise InputError(f"formula {shown(term.formula)} is no finite number at {place}: expected one wherever the hammer moves; {remedy}")
    slopes = [force(**{n: v * (1 + _STEP)}) - force(**{n: v * (1 - _STEP)}) for n, v in values.items()]
    norms = np.array([float(np.linalg.norm(one)) for one in slopes])
    if len(values) > 1 and np.isfinite(norms).all() and (norms > 0).all():
        _, sizes, directions = np.linalg.svd(np.array(slopes).T / norms, full_matrices=False)
        if sizes[-1] < _ALIKE:
            alike = [name for name, part in zip(values, np.abs(directions[-1]), strict=True) if part > 0.1]
            raise InputError(
                f"formula {shown(term.formula)}: no motion tells {' and '.join(alike)} apart; expected each to act in a way of its own; "
                "give a number in place of one"
            )
