"""How ranges and lists of values are written on the command line, the same for every study; and what each study takes."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from vibrojax.errors import InputError

FREQUENCY, AMPLITUDE = "frequency_hz", "base_amplitude"
_SPELLED = {"frequency": FREQUENCY, "amplitude": AMPLITUDE}
_MOST_VALUES = 10_000_000
"""Of one axis."""


class Axis(NamedTuple):
    """What `--sweep` may name."""

    argument: str
    """Of the study, which holds the values."""
    default: str | None = None
    """Values where none are given; None: they must be given."""
    count: int = 101
    """Values along it where a preset's range is taken."""


class Form(NamedTuple):
    """What a study takes.

    Attributes:
        axes: by name for `--sweep`; the first is meant where no name is given.
        any_parameter: whether `--sweep` may name any setting or parameter instead of the first axis.
        settings: gap, frequency or both, unless swept.
        lists: of these, the one that is an axis of the data set; several values of the other make a study each.
        varied_inside: whether several values of a model's parameter are an axis of the data set too.
    """

    axes: Mapping[str, Axis]
    any_parameter: bool = False
    settings: tuple[str, ...] = ()
    lists: tuple[str, ...] = ()
    varied_inside: bool = False


_ALONG = {"frequency": Axis("values")}
_POINT = ("gap", FREQUENCY)
_PLANE = {"u0": Axis("u0", count=51), "v0": Axis("v0", count=51)}
FORMS: dict[str, Form] = {
    "response": Form({"frequency": Axis(FREQUENCY, count=151)}, settings=("gap",), lists=("gap",), varied_inside=True),
    "bifurcation": Form(_ALONG, any_parameter=True, settings=_POINT),
    "peterka": Form({"ratio": Axis("ratio", "0.5:5:100"), "clearance": Axis("clearance", "0:3:100")}),
    "section": Form({}, settings=_POINT),
    "basins": Form(_PLANE, settings=_POINT),
    "basins_along": Form(_PLANE, settings=_POINT),
    "lyapunov": Form(_ALONG, any_parameter=True, settings=_POINT),
    "design": Form({"mass_ratio": Axis("mass_ratio", "0.1:3:100")}, settings=_POINT, lists=(FREQUENCY,)),
}
"""By the name of the command."""


def values(option: str, text: str) -> list[float]:
    """`A:B:N` or `A,B,...` as numbers.

    Example:
        >>> values("--sweep", "1:2:3"), values("--gap", "0,1e-3")
        ([1.0, 1.5, 2.0], [0.0, 0.001])
    """
    try:
        if ":" not in text:
            return [float(part) for part in text.split(",")]
        begin, end, number = text.split(":")
        first, last, count = float(begin), float(end), int(number)
    except ValueError:
        raise InputError(f"{option} is {text!r}: expected A:B:N (N values from A to B) or A,B,...; correct it") from None
    if not 1 <= count <= _MOST_VALUES:
        raise InputError(f"{option} is {text!r}: expected A:B:N with N from 1 to {_MOST_VALUES}; correct it")
    step = (last - first) / max(count - 1, 1)
    return [first + step * place for place in range(count)]


def listed(texts: Iterable[str]) -> list[str]:
    """Names of an option that may be repeated and may hold several, `A,B,...`.

    Example:
        >>> listed(["hertz,flores", "newton"])
        ['hertz', 'flores', 'newton']
    """
    return [name.strip() for text in texts for name in text.split(",")]


def first_values(texts: Iterable[str], terms: Sequence[str]) -> dict[str, float]:
    """`NAME=VALUE` of `--start`, which may be repeated, beside the `--term` whose parameters these are.

    Example:
        >>> first_values(["p=1.5"], ["-a*abs(u_dot)**p*sign(u_dot)"])
        {'p': 1.5}
    """
    found: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        name = name.strip()
        try:
            number = float(value)
        except ValueError:
            raise InputError(f"--start is {text!r}: expected NAME=VALUE, a number in SI; write, for example, p=1.5") from None
        if not name or name in found:
            raise InputError(f"--start is {text!r}: expected NAME=VALUE, each name once; correct it")
        found[name] = number
    if found and not terms:
        raise InputError(f"--start {next(iter(found))}=... is given without a term: expected --term beside it")
    return found


def ends(option: str, text: str) -> tuple[float, float]:
    """`A:B`, or `A:B:N` whose N is not needed, as two numbers."""
    parts = text.split(":")
    if len(parts) not in (2, 3):
        raise InputError(f"{option} is {text!r}: expected [NAME=]A:B, from A to B; correct it")
    first, last = values(option, ":".join([*parts[:2], "2"]))
    return first, last


def canonical(name: str) -> str:
    """Name of a setting as the library has it."""
    return _SPELLED.get(name, name)


def named(option: str, texts: Iterable[str]) -> dict[str, str]:
    """`NAME=VALUES` of an option that may be repeated; the empty name where there is none."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, listed = text.rpartition("=")
        if not listed or (equals and not name):
            raise InputError(f"{option} is {text!r}: expected NAME=VALUES; write, for example, frequency=3:9:300")
        if name in found:
            raise InputError(f"{option} names {name or 'the first axis'} twice: expected each axis once; leave one out")
        found[name] = listed
    return found


def one_range(option: str, text: str) -> tuple[str, list[float]]:
    """Name and values of `NAME=A:B:N`.

    Example:
        >>> one_range("--along", "frequency=3:5:3")
        ('frequency_hz', [3.0, 4.0, 5.0])
    """
    name, equals, listed = text.partition("=")
    if not (name and equals and listed):
        raise InputError(f"{option} is {text!r}: expected NAME=A:B:N; write, for example, {option} gap=1e-3:2e-3:10")
    return canonical(name), values(option, listed)


def swept(study: str, sweep: Sequence[str], ranges: Mapping[str, tuple[float, float]]) -> tuple[dict[str, list[float]], str]:
    """Values along the axes of a study, by argument, and the parameter that is swept ("" where the axes are fixed).

    Arguments:
        study: name of the command.
        sweep: `--sweep`, as often as it was given; a name alone takes its range.
        ranges: of a preset, both ends by the name of a setting; taken too for an axis that is left out and has no default.

    Raises:
        InputError: an unknown axis, one that is given twice or not at all, values that are none.

    Example:
        >>> swept("lyapunov", ["gap=0:1e-3:2"], {}), swept("lyapunov", ["frequency"], {"frequency_hz": (1.0, 2.0)})[0]["values"][-1]
        (({'values': [0.0, 0.001]}, 'gap'), 2.0)
    """
    form = FORMS[study]
    first = next(iter(form.axes), "")

    def whole_range(name: str) -> str:
        low, high = ranges[canonical(name)]
        return f"{low:.9g}:{high:.9g}:{form.axes[name].count if name in form.axes else 101}"

    given = named("--sweep", [f"{text}={whole_range(text)}" if canonical(text) in ranges else text for text in sweep])
    if "" in given and first in given:
        raise InputError(f"--sweep names {first} twice, once as the axis without a name: leave one out")
    given = {name or first: text for name, text in given.items()}
    along = ""
    if form.any_parameter:
        if len(given) > 1:
            raise InputError(f"--sweep is given {len(given)} times: expected one parameter that is swept; add the others with --vary")
        along = canonical(next(iter(given), first))
        given = dict(zip([first], given.values(), strict=False))
    if unknown := [name for name in given if name not in form.axes]:
        known = ", ".join(form.axes) or "none; it is one operating point"
        raise InputError(f"--sweep names {unknown[0]!r}: expected one of {known}; correct it")
    found = {}
    for name, axis in form.axes.items():
        text = given.get(name, axis.default)
        if text is None and canonical(name) not in ranges:
            raise InputError(f"--sweep {name}=A:B:N is missing: expected the values of {name}, from A to B; add it")
        found[axis.argument] = values("--sweep", whole_range(name) if text is None else text)
    return found, along


def cases(varied: Mapping[str, Sequence[float]]) -> list[tuple[str, dict[str, float]]]:
    """Every combination of values, each with what it adds to a file's name: nothing for what has one value only.

    Example:
        >>> cases({"gap": [0.0, 1e-3], "zeta": [0.1]})
        [('_gap-0', {'gap': 0.0, 'zeta': 0.1}), ('_gap-0.001', {'gap': 0.001, 'zeta': 0.1})]
    """
    found = []
    for row in itertools.product(*varied.values()):
        one = dict(zip(varied, row, strict=True))
        tail = "".join(f"_{name}-{value:g}" for name, value in one.items() if len(varied[name]) > 1)
        if any(tail == other for other, _ in found):
            raise InputError(f"values are equal to six digits ({tail[1:]}): expected one of each, since they name the files; leave one out")
        found.append((tail, one))
    return found
