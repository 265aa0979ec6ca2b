"""A force on the hammer that the user writes as a formula of the motion. Formulas are read, never executed as Python."""

import ast
import dataclasses
import functools
import itertools
import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, ClassVar, NamedTuple, NoReturn

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax

from vibrojax.effects import EFFECTS
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.free_form import FreeForm
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.errors import InputError, shown
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_BASE_UNITS = ("N", "m", "s")
_MOTION = {"u": (0, 1, 0), "u_dot": (0, 1, -1), "t": (0, 0, 1), "delta": (0, 1, 0), "delta_dot": (0, 1, -1)}
"""Symbols of the motion with the powers of N, m and s in their units."""
_FUNCTIONS = ("abs", "sign", "sqrt", "exp", "log", "sin", "cos", "tanh", "min", "max")
_TAKEN = ("x", "y", "v", "k_i", "n", "lambda_i", "zeta", "f_n", "m", "gap", "name", "formula", "label", "e")
"""Names that a reader takes for something else: other coordinates, parameters of the nominal model, keys of model.json, a constant."""
_MOST_PARAMETERS, _LONGEST, _DEEPEST = 8, 300, 40
"""Parameters, characters and nested operations of one formula."""
_CREEP = 5e-4
"""m/s; sign() of a velocity is spread over this either way, as dry friction is."""
_EXPONENTS = (1.0, 0.5, 1.5, 2.0, 3.0)
"""First values of an exponent that has no start, the first where only one is wanted."""
_PARTS_OF_SCALE = (0.3, 0.03, 0.1, 1.0)
"""First values of any other parameter that has no start, over the size that the records give its unit; likewise."""
_MOST_CANDIDATES = 64
_REFERENCE = {"amplitude": 1e-3, "speed": 0.1, "force": 1.0, "time": 10.0}
"""m, m/s, N, s: a motion on which a formula is tried when it is read, before any record."""

_STEP, _ALIKE = 1e-4, 1e-7
"""Relative step of central differences by the parameters, and the least singular value of their directions below which two are one:
differences leave 1e-8, and a tanh over its hundredth part 1e-5."""

Point = Mapping[str, Any]
Place = tuple[int, int]


class _Read(NamedTuple):
    """A formula as it was read."""

    tree: ast.expr
    names: tuple[str, ...]
    """Of its parameters, in the order in which they appear."""
    strengths: tuple[str, ...]
    """Those to which the force is proportional: all of them at zero switch it off."""
    exponents: frozenset[str]
    divisors: frozenset[str]
    powers: Mapping[str, tuple[float, ...] | None]
    """Powers of N, m and s in the unit of each parameter; None where the formula does not determine it."""
    of_velocity: frozenset[Place]
    """Where it takes the sign of a velocity."""


def _refuse(text: str, at: int, given: str, remedy: str) -> NoReturn:
    there = text[at : at + 12]
    raise InputError(f"formula {shown(text)}, character {at + 1} ({there!r}): {given}; {remedy}")


@functools.lru_cache(maxsize=128)
def _read(text: str) -> _Read:
    """Read a formula, or say what is wrong with it, and where."""
    if not text or len(text) > _LONGEST:
        raise InputError(f"formula {shown(text)} has {len(text)} characters: expected 1 to {_LONGEST}; shorten it, or write two terms")
    if (odd := next((at for at, each in enumerate(text) if not (each.isascii() and each.isprintable())), None)) is not None:
        _refuse(text, odd, "a character that no formula has", "expected letters, digits, ( ) , . and + - * / **")
    if (comment := text.find("#")) >= 0:
        _refuse(text, comment, "a comment", "expected a formula alone; leave it out")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        at = error.offset - 1 if error.offset else len(text)
        _refuse(text, at, "the formula breaks off or cannot be read", "expected an expression such as -a*u_dot*abs(u_dot)")
    except (ValueError, RecursionError, MemoryError, OverflowError):
        _refuse(text, 0, "it cannot be read", "expected an expression such as -a*u_dot*abs(u_dot)")
    names = tuple(dict.fromkeys(_checked(text, tree)))
    if len(names) > _MOST_PARAMETERS:
        _refuse(text, 0, f"it has {len(names)} parameters", f"expected at most {_MOST_PARAMETERS}; give numbers in place of some")
    if not {one.id for one in ast.walk(tree) if isinstance(one, ast.Name)} & set(_MOTION):
        remedy = f"expected one of {', '.join(_MOTION)}; a constant force is the effect constant_force"
        _refuse(text, 0, "nothing of the motion is in it", remedy)
    subsets = (subset for size in range(len(names), 0, -1) for subset in itertools.combinations(names, size))
    strengths = next((subset for subset in subsets if _order(tree, frozenset(subset)) == 1), ())
    if not strengths:
        _refuse(text, 0, "no parameter switches all of it off at zero", "expected a strength in front of every part, as in a*(...)")
    powers, of_velocity = _powers(tree, names)
    return _Read(
        tree=tree,
        names=names,
        strengths=strengths,
        exponents=frozenset(_inside(tree, ast.Pow)),
        divisors=frozenset(_inside(tree, ast.Div)) - frozenset(_inside(tree, ast.Pow)),
        powers=powers,
        of_velocity=of_velocity,
    )


def _checked(text: str, tree: ast.expr) -> Iterator[str]:
    """Names of parameters; refuses everything that is not on the list of what a formula may hold."""
    waiting: list[tuple[Any, int]] = [(tree, 0)]
    while waiting:
        node, depth = waiting.pop()
        if depth > _DEEPEST:
            _refuse(text, node.col_offset, f"more than {_DEEPEST} operations inside one another", "expected fewer; write two terms")
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                if not abs(value) < 1e300:
                    _refuse(text, node.col_offset, "the number is too large", "expected one below 1e300; correct it")
            case ast.Name(id=name):
                if name in _FUNCTIONS:
                    _refuse(text, node.col_offset, f"{name} is a function", f"expected {name}(...); write its argument")
                if name not in (*_MOTION, "pi"):
                    _check_name(text, node.col_offset, name)
                    yield name
            case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
                waiting.append((operand, depth + 1))
            case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() | ast.Pow(), left=left, right=right):
                waiting += [(right, depth + 1), (left, depth + 1)]
            case ast.BinOp(op=ast.BitXor(), right=right):
                at = text.rfind("^", 0, right.col_offset)
                _refuse(text, at, "^ is no operation of a formula", "expected ** for a power")
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
                wanted = "two or more" if name in ("min", "max") else "one"
                if any(isinstance(one, ast.Starred) for one in arguments) or (len(arguments) < 2) == (wanted != "one"):
                    _refuse(text, node.col_offset, f"{name} has {len(arguments)} arguments", f"expected {wanted}; correct it")
                waiting += [(one, depth + 1) for one in reversed(arguments)]
            case ast.Call(func=ast.Name(id=name)) if name in _FUNCTIONS:
                _refuse(text, node.col_offset, f"{name} has an argument with a name", "expected values alone; leave the name out")
            case ast.Call(func=ast.Name(id=name)):
                near = get_close_matches(name, _FUNCTIONS, n=1)
                known = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(_FUNCTIONS)}; for a product write {name}*(...)"
                _refuse(text, node.col_offset, f"no function is called {name}", known)
            case _:
                what = f"expected numbers, parameters, {', '.join(_MOTION)}, + - * / ** and {', '.join(_FUNCTIONS)}"
                _refuse(text, node.col_offset, "this cannot stand in a formula", what)


def _check_name(text: str, at: int, name: str) -> None:
    """A name of a parameter is short, and not one that a reader takes for something else."""
    if name in _TAKEN or name.endswith("_dot") or name.endswith("_ddot") or name.startswith("_") or len(name) > 32:
        _refuse(text, at, f"{name} is no name of a parameter", f"expected another name, or one of {', '.join(_MOTION)} for the motion")


def _order(node: Any, among: frozenset[str]) -> int | None:
    """0 where a formula does not depend on these parameters, 1 where it is proportional to them together, None for anything else."""
    match node:
        case ast.Name(id=name):
            return int(name in among)
        case ast.UnaryOp(operand=operand):
            return _order(operand, among)
        case ast.BinOp(op=op, left=left, right=right):
            a, b = _order(left, among), _order(right, among)
            if a is None or b is None:
                return None
            if isinstance(op, ast.Add | ast.Sub):
                return a if a == b else None
            if isinstance(op, ast.Mult):
                return a + b if a + b < 2 else None
            return a if b == 0 and (isinstance(op, ast.Div) or a == 0) else None
        case ast.Call(args=arguments):
            return 0 if all(_order(one, among) == 0 for one in arguments) else None
    return 0


def _inside(tree: ast.expr, operation: type[ast.operator]) -> Iterator[str]:
    """Parameters in exponents, or in divisors."""
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, operation):
            yield from (one.id for one in ast.walk(node.right) if isinstance(one, ast.Name) and one.id not in (*_MOTION, "pi", *_FUNCTIONS))


class _Dimension(NamedTuple):
    """Powers of N, m and s: known ones, and those of parameters, each so many times."""

    known: np.ndarray
    of: Mapping[str, float]

    def plus(self, other: "_Dimension", times: float = 1.0) -> "_Dimension":
        """That of a product, or, -1 times, of a quotient."""
        of = {name: self.of.get(name, 0.0) + times * other.of.get(name, 0.0) for name in {*self.of, *other.of}}
        return _Dimension(self.known + times * other.known, of)


_PLAIN = _Dimension(np.zeros(3), {})


def _powers(tree: ast.expr, names: tuple[str, ...]) -> tuple[dict[str, tuple[float, ...] | None], frozenset[Place]]:
    """Powers of N, m and s in the units of the parameters, of a force in N; and where the sign of a velocity is taken.

    Every sum, comparison, exponent and argument is an equation between dimensions, linear in those of the parameters. Numbers in a sum
    have the unit of what stands beside them.
    """
    zero: list[_Dimension] = []
    signs: list[tuple[Place, _Dimension]] = []

    def same(parts: Sequence[_Dimension | None]) -> _Dimension | None:
        dimensioned = [part for part in parts if part is not None]
        zero.extend(part.plus(dimensioned[0], -1.0) for part in dimensioned[1:])
        return dimensioned[0] if dimensioned else None

    def walk(node: Any) -> _Dimension | None:
        match node:
            case ast.Name(id=name):
                if name == "pi":
                    return None
                return _Dimension(np.array(_MOTION[name], float), {}) if name in _MOTION else _Dimension(np.zeros(3), {name: 1.0})
            case ast.UnaryOp(operand=operand):
                return walk(operand)
            case ast.BinOp(op=ast.Add() | ast.Sub(), left=left, right=right):
                return same([walk(left), walk(right)])
            case ast.BinOp(op=ast.Mult() | ast.Div() as op, left=left, right=right):
                a, b = walk(left), walk(right)
                return None if a is None and b is None else (a or _PLAIN).plus(b or _PLAIN, -1.0 if isinstance(op, ast.Div) else 1.0)
            case ast.BinOp(op=ast.Pow(), left=left, right=right):
                base, exponent = walk(left), walk(right)
                constant = float(_value(right, {}, np, frozenset())) if exponent is None else math.nan
                if base is not None and abs(constant) < 100.0:
                    return _PLAIN.plus(base, constant)
                zero.extend([exponent] if exponent is not None else [])
                unknown = f"power at {node.right.col_offset}"
                return None if base is None else _Dimension(np.zeros(3), {unknown: 1.0})
            case ast.Call(func=ast.Name(id=function), args=arguments):
                parts = [walk(one) for one in arguments]
                first = same(parts)
                if function == "sign" and first is not None:
                    signs.append(((node.lineno, node.col_offset), first))
                if function in ("exp", "log", "sin", "cos", "tanh"):
                    zero.extend([first] if first is not None else [])
                if function == "sqrt":
                    return None if first is None else _PLAIN.plus(first, 0.5)
                return first if function in ("abs", "min", "max") else _PLAIN
        return None

    root = walk(tree)
    zero += [] if root is None else [root.plus(_Dimension(np.array([1.0, 0.0, 0.0]), {}), -1.0)]
    unknown = list(dict.fromkeys([*names, *(name for one in [*zero, *(d for _, d in signs)] for name in one.of)]))
    rows = np.array([[one.of.get(name, 0.0) for name in unknown] for one in zero]).reshape(len(zero), len(unknown))
    right = -np.array([one.known for one in zero]).reshape(len(zero), 3)
    found, *_ = np.linalg.lstsq(rows, right, rcond=None)
    consistent = bool(np.allclose(rows @ found, right, atol=1e-9))
    free = np.eye(len(unknown)) - np.linalg.pinv(rows) @ rows
    determined = {name: consistent and not np.abs(free[place]).max() > 1e-9 for place, name in enumerate(unknown)}
    powers = {name: tuple((np.round(found[place], 6) + 0.0).tolist()) if determined[name] else None for place, name in enumerate(unknown)}
    velocities = set[Place]()
    for place, one in signs:
        if all(determined[name] for name, times in one.of.items() if times):
            whole = one.known + sum((times * np.array(powers[name]) for name, times in one.of.items() if times), np.zeros(3))
            velocities |= {place} if np.allclose(whole, _MOTION["u_dot"]) else set()
    return {name: powers[name] for name in names}, frozenset(velocities)


def _unit(powers: tuple[float, ...] | None) -> str:
    """Unit of a parameter as text; "SI" where the formula does not determine it."""
    if powers is None:
        return "SI"
    above, below = (
        [name if abs(p) == 1 else f"{name}^{abs(p):g}" for name, p in zip(_BASE_UNITS, powers, strict=True) if p * way > 0]
        for way in (1, -1)
    )
    under = f"/({' '.join(below)})" if len(below) > 1 else f"/{below[0]}" if below else ""
    return (" ".join(above) or "1") + under


def _power(base: Any, exponent: Any, xp: Any) -> Any:
    """base ** exponent, whose derivative at base 0 is taken as 0: the hammer stops there, and the true one may be infinite."""
    if xp is np:
        return np.power(np.asarray(base, float), exponent)
    nothing = base == 0.0
    at_zero = lax.stop_gradient(jnp.power(jnp.zeros_like(jnp.asarray(base, float)), exponent))
    return jnp.where(nothing, at_zero, jnp.power(jnp.where(nothing, 1.0, base), exponent))


def _value(node: Any, at: Point, xp: Any, of_velocity: frozenset[Place]) -> Any:
    """A formula at a point of the motion, or at many, with NumPy or JAX."""
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id=name):
            return math.pi if name == "pi" else at[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, at, xp, of_velocity)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(op=op, left=left, right=right):
            a, b = _value(left, at, xp, of_velocity), _value(right, at, xp, of_velocity)
            if isinstance(op, ast.Pow):
                whole = isinstance(b, float) and b == int(b) and 0 <= b <= 32
                return xp.asarray(a, float) ** int(b) if whole else _power(a, b, xp)
            if isinstance(op, ast.Div):
                return xp.divide(a, b)
            return a + b if isinstance(op, ast.Add) else a - b if isinstance(op, ast.Sub) else a * b
        case ast.Call(func=ast.Name(id=function), args=arguments):
            values = [_value(one, at, xp, of_velocity) for one in arguments]
            if function in ("min", "max"):
                return functools.reduce(xp.minimum if function == "min" else xp.maximum, values)
            if function == "sign" and (node.lineno, node.col_offset) in of_velocity:
                return xp.tanh(values[0] / _CREEP)
            return _power(values[0], 0.5, xp) if function == "sqrt" else getattr(xp, function)(values[0])
    raise TypeError(f"{type(node).__name__} cannot stand in a formula")


def _along(motion: Motion) -> dict[str, Any]:
    return {"u": motion.u, "u_dot": motion.v, "t": motion.t, "delta": motion.indentation, "delta_dot": motion.indentation_rate}


def _points(amplitude: float, speed: float, latest: float, deepest: float) -> dict[str, np.ndarray]:
    """Points all over a motion of this size, zeros included."""
    part = np.linspace(-1.0, 1.0, 5)
    axes = (amplitude * part, speed * part, latest * np.array([0.0, 0.37, 1.0]), np.unique([-amplitude, 0.0, 0.5 * deepest, deepest]))
    u, v, t, delta = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    return {"u": u, "u_dot": v, "t": t, "delta": delta, "delta_dot": v}


def _equation(effect: "Formula") -> str:
    return f"force = {effect.formula.replace('**', '^')}"


def _name(effect: "Formula") -> str:
    return effect.label or effect.formula


def _summary(effect: "Formula") -> str:
    return f"the force {effect.label} = {effect.formula}" if effect.label else f"the force {effect.formula}"


def _parameters(effect: "Formula") -> tuple[Parameter, ...]:
    """One for each name in the formula that is no part of the motion."""
    read, found = _read(effect.formula), []
    for place, name in enumerate(read.names, start=1):
        options: dict[str, Any] = {"lower": -np.inf, "logarithmic": False, "start": 1.0, "meaning": f"parameter of {effect.name}"}
        if name in read.strengths:
            options |= {"start": 0.0, "meaning": f"strength of {effect.name}"}
        elif name in read.exponents:
            options |= {"lower": 0.05, "upper": 6.0, "logarithmic": True, "meaning": f"exponent in {effect.name}"}
        elif name in read.divisors:
            options |= {"lower": 1e-12, "logarithmic": True, "meaning": f"divisor in {effect.name}"}
        found.append(Parameter(name=name, field=f"p{place}", symbol=name, unit=_unit(read.powers[name]), **options))
    return tuple(found)


def _probe(effect: "Formula") -> Probe["Formula"]:
    """Its strengths are estimated together, beside every combination of the first values of its other parameters."""
    strengths = tuple(effect.field(name) for name in _read(effect.formula).strengths)
    return Probe(lambda scales: _candidates(effect, scales), parts=strengths if len(strengths) > 1 else (), either_sign=True)


def _first_values(effect: "Formula", amplitude: float, speed: float, force: float) -> Iterator[dict[str, float]]:
    """First values of all parameters but the strengths, the most plausible ones first."""
    read, given = _read(effect.formula), dict(effect.starts)
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
    """At the largest motion, each strength a hundredth of the forces in flight; none where the formula cannot act."""
    read = _read(effect.formula)
    if not scales.flight_force > 0.0:
        return
    points = _points(scales.amplitude, scales.speed, scales.latest, scales.deepest)
    for others in _first_values(effect, scales.amplitude, scales.speed, scales.flight_force):
        strengths = {}
        for name in read.strengths:
            with np.errstate(all="ignore"):
                force = _value(read.tree, points | dict.fromkeys(read.strengths, 0.0) | {name: 1.0} | others, np, read.of_velocity)
            largest = float(np.max(np.abs(force)))
            if not (math.isfinite(largest) and largest > 0.0):
                break
            strengths[name] = 0.01 * scales.flight_force / largest
        else:
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

    name: ClassVar[str] = property(_name)  # type: ignore[assignment]
    summary: ClassVar[str] = property(_summary)  # type: ignore[assignment]
    equation: ClassVar[str] = property(_equation)  # type: ignore[assignment]
    source: ClassVar[str] = "given by the user"
    parameters: ClassVar[tuple[Parameter, ...]] = property(_parameters)  # type: ignore[assignment]
    own_states: ClassVar[tuple[OwnState, ...]] = ()
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
        if self.label in EFFECTS or self.label == FreeForm.name:
            raise InputError(f"{self.label!r} is the name of a listed effect: expected another for a term; rename it")
        _read(self.formula)

    @property
    def strengths(self) -> tuple[str, ...]:
        """Names of the parameters to which the force is proportional."""
        return _read(self.formula).strengths

    @property
    def switch_speed(self) -> float | None:
        """Of a formula with the sign of a velocity, m/s."""
        return _CREEP if _read(self.formula).of_velocity else None

    def field(self, name: str) -> str:
        """Attribute that holds a parameter."""
        return f"p{_read(self.formula).names.index(name) + 1}"

    def scaled(self, factor: Value) -> "Formula":
        """All strengths in proportion."""
        fields = [self.field(name) for name in self.strengths]
        return dataclasses.replace(self, **{field: factor * getattr(self, field) for field in fields})

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Towards the stop, N."""
        read = _read(self.formula)
        values = {name: getattr(self, f"p{place}") for place, name in enumerate(read.names, start=1)}
        return jnp.zeros_like(motion.u) + _value(read.tree, _along(motion) | values, jnp, read.of_velocity)


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
    """Refuse a formula that is not finite on a motion of usual size, or of which no motion tells all parameters apart."""
    read, size = _read(term.formula), _REFERENCE
    points = _points(size["amplitude"], size["speed"], size["time"], 0.1 * size["amplitude"])
    values = dict.fromkeys(read.strengths, 1.0) | next(_first_values(term, size["amplitude"], size["speed"], size["force"]))

    def force(**changed: float) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.broadcast_to(_value(read.tree, points | values | changed, np, read.of_velocity), points["u"].shape)

    if (wrong := np.flatnonzero(~np.isfinite(force()))).size:
        place = ", ".join(f"{name} = {points[name][wrong[0]]:g}" for name in _MOTION if re.search(rf"\b{name}\b", term.formula))
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
