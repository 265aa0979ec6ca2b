"""Reference values of parameters - from a thesis, a data sheet, an earlier test - and their comparison with a fit."""

import dataclasses
import math
from collections.abc import Iterable
from pathlib import Path

from identification.experiment.errors import ExperimentError, check_printable, shown
from identification.experiment.toml_file import Table, parse_toml
from identification.result.result import FitResult
from vibrojax.errors import InputError
from vibrojax.model import MASS

ABSENT = "not stated"
"""Text in place of a value that the source holds but that has not been entered."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReferenceValue:
    """One reference value: name as in `fit.json`, the symbol and the place (figure, table or page) of its source.

    `value` and its standard error are in `unit`; None where they have not been entered.
    """

    name: str
    symbol: str
    value: float | None
    unit: str
    source: str
    stderr: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reference:
    """A table of reference values, from `file`."""

    title: str
    file: str
    values: tuple[ReferenceValue, ...]

    def of(self, name: str) -> ReferenceValue | None:
        """The row of that name, or None."""
        return next((row for row in self.values if row.name == name), None)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Comparison:
    """One fitted number beside the row of its reference value; None where there is no row."""

    name: str
    symbol: str
    unit: str
    value: float
    stderr: float | None
    row: ReferenceValue | None

    @property
    def reference(self) -> float | None:
        """The known value, in the unit of the fitted one."""
        return None if self.row is None else self.row.value

    @property
    def reference_stderr(self) -> float | None:
        """Its standard error."""
        return None if self.row is None else self.row.stderr

    @property
    def sigmas(self) -> float | None:
        """Fitted less reference over the standard error of the difference; None where that is not known."""
        if self.reference is None or self.stderr is None:
            return None
        error = math.hypot(self.stderr, self.reference_stderr or 0.0)
        return (self.value - self.reference) / error if error else None

    @property
    def percent(self) -> float | None:
        """Fitted less reference in per cent of the reference; None where there is none."""
        return 100.0 * (self.value - self.reference) / abs(self.reference) if self.reference else None

    @property
    def remark(self) -> str:
        """Source of the reference value, or why there is none."""
        if self.row is None:
            return "no reference value"
        return self.row.source if self.row.value is not None else f"no reference value: {self.row.source} is not known here"


def read_reference(path: Path) -> Reference:
    """Read a table of reference values.

    The file is TOML: `schema = 1`, `title`, and one `[[value]]` per number with `name`, `symbol`, `value`, `unit`, `source` and, if
    wanted, `stderr`, `note` and `printed_unit`. A `value` that is the text "not stated" states that the source holds the number
    but that it is not known here.

    Raises:
        InputError: the file cannot be read or is not of this format; the message states where.
    """
    values, _ = parse_toml(path)
    table = Table(values=values, where=path.name)
    table.allow("schema", "title", "value")
    _check_shown(values, path.name)
    if table.needed_number("schema", unit="") != 1:
        raise ExperimentError(f"schema in {path.name} is {shown(values['schema'])}: expected 1")
    title = table.needed_string("title")
    rows = values.get("value")
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise ExperimentError(f"{path.name} holds no reference value: expected at least one [[value]] table; add one")
    read = tuple(_row(row, f"value {number} of {path.name}") for number, row in enumerate(rows, start=1))
    names = [row.name for row in read]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"{path.name} gives {shown(repeated[0])} twice: expected each name once; remove or rename one")
    return Reference(title=title, file=path.name, values=read)


def check_reference(reference: Reference, units: dict[str, str]) -> None:
    """Check before a fit that a reference can be compared with it; `units` are by name of every number that it will have, mass included.

    Raises:
        InputError: a row has another unit than the parameter of that name, or no row has the name of a parameter.
    """
    for row in reference.values:
        if row.value is not None and row.name in units and row.unit != units[row.name]:
            raise InputError(
                f"{reference.file} gives {row.name} in {shown(row.unit)}: expected {shown(units[row.name])}; convert it (and its stderr)"
            )
    if not any(row.name in units for row in reference.values):
        raise InputError(
            f"{reference.file} has no row for any parameter of this fit: expected names among {', '.join(units)}; correct the names"
        )


def compare(result: FitResult, reference: Reference) -> tuple[Comparison, ...]:
    """Compare every fitted and derived number, and the mass, with its reference value; errors as for `check_reference`."""
    fitted = [(p.spec, p.value, p.stderr) for p in result.parameters] + [(d, d.value, d.stderr) for d in result.derived]
    if all(one.name != MASS.name for one, *_ in fitted):
        fitted.append((MASS, float(result.model.mass), None))
    check_reference(reference, {one.name: one.unit for one, *_ in fitted})
    return tuple(
        Comparison(name=one.name, symbol=one.symbol, unit=one.unit, value=value, stderr=stderr, row=reference.of(one.name))
        for one, value, stderr in fitted
    )


def unmatched(comparisons: Iterable[Comparison], reference: Reference) -> tuple[str, ...]:
    """Names of reference values that are not among the numbers of the fit."""
    known = {row.name for row in comparisons}
    return tuple(row.name for row in reference.values if row.name not in known)


def _check_shown(values: dict[str, object], where: str) -> None:
    """Every text of the table is shown on the page."""
    for key, value in values.items():
        if isinstance(value, str):
            check_printable(" ".join(value.split()), f"{key} in {where}")


def _row(values: dict[str, object], where: str) -> ReferenceValue:
    _check_shown(values, where)
    table = Table(values=values, where=where)
    table.allow("name", "symbol", "value", "unit", "source", "stderr", "note", "printed_unit")
    absent = values.get("value") == ABSENT
    if isinstance(values.get("value"), str) and not absent:
        raise ExperimentError(f"value in {where} is {shown(values['value'])}: expected a number, or the text {ABSENT!r}")
    return ReferenceValue(
        name=table.needed_string("name"),
        symbol=table.needed_string("symbol"),
        value=None if absent else table.needed_number("value", unit="in the row's unit"),
        unit=table.needed_string("unit"),
        source=table.needed_string("source"),
        stderr=table.number("stderr", positive=True),
    )
