"""Workbooks of a spreadsheet: the sheet with the most numbers, read as the text that it would be exported to."""

import datetime
from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Any

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.delimited import read_text
from identification.experiment.readers.recorder import load_library
from identification.experiment.readers.text import DECIMALS, is_number

LIBRARY = "python_calamine"


class ExcelReader(AbstractReader):
    """Reads columns of numbers below a header row, as `DelimitedReader` does: units, lines above and below, and times of day are the same.

    Of several sheets the one with the most numbers counts.
    """

    suffixes = (".xlsx", ".xls", ".ods")
    format = "workbook"
    apart = True
    library = LIBRARY

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        library = load_library(LIBRARY, self.format)
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
