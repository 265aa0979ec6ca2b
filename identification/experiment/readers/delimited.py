"""Tables of text: delimited, plain or gzip-compressed, as recorders and spreadsheets write it; and workbooks, read as such text."""

import datetime
from array import array
from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import TIME, is_time
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_samples
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.labview import find_labview
from identification.experiment.readers.layout import BLANKS, Layout, find_layout, skipped, split
from identification.experiment.readers.recorder import common_axis, load_library
from identification.experiment.readers.text import DECIMALS, is_clock, is_number, read_lines, seconds_of, to_number


class DelimitedReader(AbstractReader):
    """Reads columns of numbers, separated by tab, semicolon, comma or blanks, below a header row.

    Decimal point or comma; a row of units below the header row and the recorder's lines above it are understood (`find_layout`). Blank
    lines and those that begin with "#", "%" or "//" are skipped, as are rows below the samples that begin with a word; a header that comes
    again ends the run. An empty cell is a sample that was not recorded (NaN), the sign of infinity one that was overloaded. Where no column
    shows the time and the recorder states its sampling rate, the column "time" follows from that.
    """

    suffixes = tuple(f"{bare}{packed}" for packed in ("", ".gz") for bare in (".csv", ".tsv", ".txt", ".asc", ".dat", ".lvm"))
    format = "delimited text"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        lines, notice = read_lines(path)
        return read_text(lines, wanted, notice)


def read_text(lines: list[str], wanted: AbstractSet[str], notice: str = "") -> Columns:
    """Read the wanted columns of a text, given by its lines; `notice` is a sentence on how they came about."""
    layout, lines = find_labview(lines) or (find_layout(lines), lines)
    names = layout.names
    notices = (notice,) if notice else ()
    if layout.first is None:
        return Columns(names=names, values={name: np.empty(0) for name in names if name in wanted}, notices=notices)
    if layout.end is not None:
        notices += (f"What stands below the samples, from line {layout.end + 1} on ({shown(lines[layout.end])}), is left out.",)
        lines = lines[: layout.end]
    check_samples(len(lines) - layout.first, "the file")
    rate = layout.rate
    blank = [name for name in names if is_time(name, layout.units.get(name))] if rate is not None else []
    asked = (wanted & set(names)) | set(blank) | ({names[0]} if rate is not None else set())
    asked |= {own for name, own in layout.own_times.items() if name in wanted}
    values = _fast(lines[layout.first :], layout, asked)
    if values is None:
        values = parse_cells(lines, layout, asked)
    if own := {name: values[time] for name, time in layout.own_times.items() if name in values and time in values}:
        values[next(iter(layout.own_times.values()))] = common_axis(own.items())
    stamped = [name for name in blank if np.isfinite(values[name]).any()]
    units = {name: unit for name, unit in layout.units.items() if name in wanted}
    if rate is not None and not stamped and TIME not in names:
        names = (TIME, *(name for name in names if name not in blank))
        values[TIME], units[TIME] = np.arange(values[layout.columns[0][1]].size) / rate, "s"
        notices += (f"The file states no time stamps; they follow from its sampling rate of {rate:.6g} Hz.",) if TIME in wanted else ()
    return Columns(
        names=names,
        values={name: column for name, column in values.items() if name in wanted and name in names},
        units=units,
        notices=notices,
    )


def _fast(lines: list[str], layout: Layout, wanted: AbstractSet[str]) -> dict[str, Float64[np.ndarray, " samples"]] | None:
    """Let NumPy's C parser try; None where a cell is empty, holds text or is lacking: then the slow way explains or forgives it."""
    if layout.decimal == ",":
        if any("." in line for line in lines):  # marks between thousands, or points where the other rows have commas
            return None
        lines = [line.replace(",", ".") for line in lines]
    try:
        delimiter = None if layout.delimiter == BLANKS else layout.delimiter
        table = np.loadtxt(lines, delimiter=delimiter, comments="#", quotechar='"', ndmin=2)
    except ValueError:
        return None
    if table.shape[1] != layout.width:
        return None
    return {name: np.ascontiguousarray(table[:, place]) for place, name in layout.columns if name in wanted}


def parse_cells(lines: list[str], layout: Layout, wanted: AbstractSet[str]) -> dict[str, Float64[np.ndarray, " samples"]]:
    """Parse the wanted columns cell by cell: slower, but it forgives empty cells (NaN) and says in which line and column a fault is.

    Text in another column does no harm. Times of day become seconds since the first of them.
    """
    first = layout.first or 0
    places = [(place, name, array("d")) for place, name in layout.columns if name in wanted]
    clocks: dict[str, list[str]] = {}
    for number, line in enumerate(lines[first:], start=first + 1):
        bare = line.partition("#")[0] if "#" in line else line
        if skipped(bare):
            continue
        cells = split(bare, layout.delimiter)
        if len(cells) != layout.width:
            raise ExperimentError(
                f"line {number} has {len(cells)} cells: expected {layout.width}, one for each column of the header row; correct the line"
            )
        for place, name, column in places:
            if is_clock(cells[place]):
                clocks.setdefault(name, []).append(cells[place])
                column.append(np.nan)
            else:
                column.append(_number(cells[place], layout, number, name))
    found = {name: np.array(column, dtype=np.float64) for _, name, column in places}
    for name, stamps in clocks.items():
        if len(stamps) != found[name].size:
            raise ExperimentError(f"column {shown(name)} holds times of day and numbers: expected one of the two; export it again")
        found[name] = seconds_of(stamps)
    return found


def _number(cell: str, layout: Layout, line: int, name: str) -> float:
    """Read one cell; empty is NaN. Underscores, which Python would accept, are no part of a number."""
    if not cell:
        return np.nan
    value = to_number(cell, layout.decimal)
    if value is None:
        remedy = "leave the cell empty where nothing was recorded"
        if layout.delimiter == BLANKS:
            remedy = "write nan where nothing was recorded"
        elif "," in cell or "." in cell:
            mark = "point" if layout.decimal == "." else "comma"
            remedy = f"write a decimal {mark} as in the other rows, and no mark between thousands"
        example = "1.5e-3".replace(".", layout.decimal)
        raise ExperimentError(f"line {line}, column {shown(name)}: {shown(cell)} is not a number: expected one such as {example}; {remedy}")
    return value


class ExcelReader(AbstractReader):
    """Reads columns of numbers below a header row, as `DelimitedReader` does: units, lines above and below, and times of day are the same.

    Of several sheets the one with the most numbers counts.
    """

    suffixes = (".xlsx", ".xls", ".ods")
    format = "workbook"
    apart = True
    library = "python_calamine"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        library = load_library(self.library, self.format)
        with library.CalamineWorkbook.from_path(str(path)) as book:
            sheets = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names}
        numbers = {name: sum(_is_number(cell) for row in rows for cell in row) for name, rows in sheets.items()}
        most = max(numbers, key=lambda name: numbers[name], default=None)
        if most is None or not numbers[most]:
            raise ExperimentError("the workbook holds no number: expected a sheet with a header row and samples below it; export it again")
        filled = [name for name, count in numbers.items() if count]
        notice = f"Of {len(filled)} sheets with numbers, {shown(most)} is read, which has the most." if len(filled) > 1 else ""
        return read_text(["\t".join(map(_text, row)) for row in sheets[most]], wanted, notice)


def _is_number(cell: Any) -> bool:
    """Whether a cell holds a number, or a text that is one."""
    if isinstance(cell, str):
        return any(is_number(cell.strip(), mark) for mark in DECIMALS)
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _text(cell: Any) -> str:
    """A cell as text, numbers with all digits."""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, datetime.datetime | datetime.time):
        return cell.isoformat(timespec="microseconds")
    return " ".join(str(cell).split())
