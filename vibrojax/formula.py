"""Formulas of the motion: read against a list of operations, with the units of their parameters; never executed as Python.

A formula is a Python expression in u, u_dot, delta, delta_dot, t and pi, with + - * / ** and a few functions; every other name is a
parameter. Units follow from linear equations between the dimensions of its parts (P. W. Bridgman, Dimensional Analysis, 1922).
"""

import ast
import functools
import itertools
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, NamedTuple, NoReturn

import jax.numpy as jnp
import numpy as np
from jax import lax

from vibrojax.errors import InputError, shown

_BASE_UNITS = ("N", "m", "s")
MOTION = {"u": (0, 1, 0), "u_dot": (0, 1, -1), "t": (0, 0, 1), "delta": (0, 1, 0), "delta_dot": (0, 1, -1)}
"""Symbols of the motion with the powers of N, m and s in their units."""
_FUNCTIONS = ("abs", "sign", "sqrt", "exp", "log", "sin", "cos", "tanh", "min", "max")
_TAKEN = ("x", "y", "v", "k_i", "n", "lambda_i", "zeta", "f_n", "m", "gap", "name", "formula", "label", "e")
"""Names that a reader takes for something else: other coordinates, parameters of the nominal model, keys of model.json, a constant."""
_MOST_PARAMETERS, _LONGEST, _DEEPEST = 8, 300, 40
"""Parameters, characters and nested operations of one formula."""
CREEP = 5e-4
"""m/s; sign() of a velocity is spread over this either way, as dry friction is."""

Point = Mapping[str, Any]
Place = tuple[int, int]


class Expression(NamedTuple):
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
def read_formula(text: str) -> Expression:
    """Read a formula of at most 300 characters.

    Raises:
        InputError: it cannot be read, holds what no formula holds, has too many parameters, or none that switches all of it off; the
            message names the character.
    """
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
    if not {one.id for one in ast.walk(tree) if isinstance(one, ast.Name)} & set(MOTION):
        remedy = f"expected one of {', '.join(MOTION)}; a constant force is the effect constant_force"
        _refuse(text, 0, "nothing of the motion is in it", remedy)
    subsets = (subset for size in range(len(names), 0, -1) for subset in itertools.combinations(names, size))
    strengths = next((subset for subset in subsets if _order(tree, frozenset(subset)) == 1), ())
    if not strengths:
        _refuse(text, 0, "no parameter switches all of it off at zero", "expected a strength in front of every part, as in a*(...)")
    powers, of_velocity = _powers(tree, names)
    return Expression(
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
                if name not in (*MOTION, "pi"):
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
                what = f"expected numbers, parameters, {', '.join(MOTION)}, + - * / ** and {', '.join(_FUNCTIONS)}"
                _refuse(text, node.col_offset, "this cannot stand in a formula", what)


def _check_name(text: str, at: int, name: str) -> None:
    """A name of a parameter is short, and not one that a reader takes for something else."""
    if name in _TAKEN or name.endswith("_dot") or name.endswith("_ddot") or name.startswith("_") or len(name) > 32:
        _refuse(text, at, f"{name} is no name of a parameter", f"expected another name, or one of {', '.join(MOTION)} for the motion")


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
            yield from (one.id for one in ast.walk(node.right) if isinstance(one, ast.Name) and one.id not in (*MOTION, "pi", *_FUNCTIONS))


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
                return _Dimension(np.array(MOTION[name], float), {}) if name in MOTION else _Dimension(np.zeros(3), {name: 1.0})
            case ast.UnaryOp(operand=operand):
                return walk(operand)
            case ast.BinOp(op=ast.Add() | ast.Sub(), left=left, right=right):
                return same([walk(left), walk(right)])
            case ast.BinOp(op=ast.Mult() | ast.Div() as op, left=left, right=right):
                a, b = walk(left), walk(right)
                return None if a is None and b is None else (a or _PLAIN).plus(b or _PLAIN, -1.0 if isinstance(op, ast.Div) else 1.0)
            case ast.BinOp(op=ast.Pow(), left=left, right=right):
                base, exponent = walk(left), walk(right)
                plain = not any(isinstance(one, ast.Name) and one.id not in ("pi", *_FUNCTIONS) for one in ast.walk(right))
                with np.errstate(all="ignore"):
                    constant = float(evaluated(right, {}, np, frozenset())) if plain else math.nan
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
            velocities |= {place} if np.allclose(whole, MOTION["u_dot"]) else set()
    return {name: powers[name] for name in names}, frozenset(velocities)


def unit_of(powers: tuple[float, ...] | None) -> str:
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


def evaluated(node: Any, at: Point, xp: Any, of_velocity: frozenset[Place]) -> Any:
    """A formula, N, at a point of the motion, or at many, with NumPy or JAX.

    Args:
        node: tree of an `Expression`, or a part of it.
        at: values by symbol and parameter, SI, arrays of one shape or numbers.
        xp: `numpy` or `jax.numpy`.
        of_velocity: where the sign of a velocity is taken, which is smooth over `CREEP`.
    """
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id=name):
            return math.pi if name == "pi" else at[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = evaluated(operand, at, xp, of_velocity)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(op=op, left=left, right=right):
            a, b = evaluated(left, at, xp, of_velocity), evaluated(right, at, xp, of_velocity)
            if isinstance(op, ast.Pow):
                whole = isinstance(b, float) and math.isfinite(b) and b == int(b) and 0 <= b <= 32
                return xp.asarray(a, float) ** int(b) if whole else _power(a, b, xp)
            if isinstance(op, ast.Div):
                return xp.divide(a, b)
            return a + b if isinstance(op, ast.Add) else a - b if isinstance(op, ast.Sub) else a * b
        case ast.Call(func=ast.Name(id=function), args=arguments):
            values = [evaluated(one, at, xp, of_velocity) for one in arguments]
            if function in ("min", "max"):
                return functools.reduce(xp.minimum if function == "min" else xp.maximum, values)
            if function == "sign" and (node.lineno, node.col_offset) in of_velocity:
                return xp.tanh(values[0] / CREEP)
            return _power(values[0], 0.5, xp) if function == "sqrt" else getattr(xp, function)(values[0])
    raise TypeError(f"{type(node).__name__} cannot stand in a formula")
