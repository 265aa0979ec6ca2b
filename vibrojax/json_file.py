"""JSON files: written strictly; from elsewhere parsed within limits, with messages that say what was given, expected and to be done."""

import dataclasses
import difflib
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

from vibrojax.errors import InputError, one_line, shown

MAX_BYTES = 10_000_000


def read_json(path: Path, expected: str) -> Any:
    """A JSON document, with what plain parsing lets through refused.

    Args:
        path: of the file.
        expected: what the file should be, for messages.

    Raises:
        InputError: it cannot be read, is too large, is not JSON, or gives a key twice.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror or error}): expected {expected}") from error
    if len(content) > MAX_BYTES:
        raise InputError(f"{path} is larger than {MAX_BYTES} bytes: expected {expected}")
    try:
        return json.loads(content.decode("utf-8-sig"), object_pairs_hook=_without_repetition)
    except (ValueError, RecursionError) as error:
        raise InputError(" ".join(f"{path} is not valid JSON ({error}): expected {expected}".split())) from error


def write_json(document: Any, path: Path) -> None:
    """Write plain data as JSON in UTF-8, indented; a number that is not finite is a `ValueError`."""
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"key {shown(key)} is given twice")
        found[key] = value
    return found


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """One object of a document and the words that place it: typed access, with messages that say what to do.

    Attributes:
        values: the object as parsed.
        where: how messages name it.
        expected: what the file should be, for messages.
    """

    values: Any
    where: str
    expected: str

    def __post_init__(self) -> None:
        if not isinstance(self.values, dict):
            self.refuse(f"a {type(self.values).__name__} where an object {{…}} is expected; correct it")

    def refuse(self, problem: str) -> NoReturn:
        """Say what is wrong with the object."""
        raise InputError(one_line(f"{self.where}: {problem}"))

    def needed(self, key: str) -> Any:
        """A value that must be there."""
        return self.values[key] if key in self.values else self.refuse(f"{key!r} is missing; expected {self.expected}")

    def allow(self, known: Iterable[str]) -> None:
        """Refuse every other key."""
        for key in self.values:
            if key not in known:
                self.refuse(f"unknown key {shown(key)}{_suggestion(key, known)}")

    def table(self, key: str) -> "Table":
        """An object below this one."""
        return dataclasses.replace(self, values=self.needed(key), where=f"{self.where}, {key}")

    def tables(self, key: str) -> list["Table"]:
        """Objects of a list that may be missing."""
        values = self.values.get(key, [])
        if not isinstance(values, list):
            self.refuse(f"{key} is a {type(values).__name__}: expected a list of objects {{…}}")
        return [dataclasses.replace(self, values=value, where=f"{self.where}, {key}[{index}]") for index, value in enumerate(values)]

    def text(self, key: str) -> str:
        """A text."""
        value = self.needed(key)
        if not isinstance(value, str):
            self.refuse(f"{key} is {shown(value)}: expected a text in quotes")
        return value

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self.needed(key)
        if not isinstance(value, bool):
            self.refuse(f"{key} is {shown(value)}: expected true or false")
        return value

    def numbers(self, key: str, *, most: int) -> tuple[float, ...]:
        """A list of so many finite numbers at most."""
        values = self.needed(key)
        if not isinstance(values, list) or len(values) > most:
            self.refuse(f"{key} is {shown(values)}: expected a list of at most {most} numbers")
        parts = dataclasses.replace(self, values={f"{key}[{index}]": value for index, value in enumerate(values)})
        return tuple(parts.number(name, zero=True, negative=True) for name in parts.values)

    def choice(self, key: str, known: Iterable[str]) -> str:
        """One of some texts."""
        value = self.needed(key)
        if not isinstance(value, str) or value not in known:
            self.refuse(f"unknown {key} {shown(value)}{_suggestion(str(value), known)}")
        return value

    def number(self, key: str, *, zero: bool, negative: bool = False, most: float = math.inf) -> float:
        """A finite number above zero, or also zero itself, or any."""
        value = self.needed(key)
        wanted = "a finite number" if negative else f"a finite number {'of at least' if zero else 'above'} 0"
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(f"{key} is {shown(value)}: expected {wanted}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number) or (number < 0 and not negative) or (number == 0 and not zero):
            self.refuse(f"{key} is {number}: expected {wanted}")
        if number > most:
            self.refuse(f"{key} is {number}: expected a number of at most {most:g}")
        return number


def _suggestion(given: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(given[:60], list(known), n=1)
    return f": did you mean {near[0]!r}?" if near else f": expected one of {', '.join(known)}"
