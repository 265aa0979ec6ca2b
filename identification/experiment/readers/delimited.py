"""Delimited text, plain or gzip-compressed."""

import csv
import gzip
import io
from collections.abc import Set as AbstractSet
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.cells import parse_cells
from identification.experiment.readers.limits import MAX_TEXT_BYTES, allowed_bytes, check_samples

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}


class DelimitedReader(AbstractReader):
    """Reads columns separated by comma, semicolon or tab, below one header row.

    Decimal point; UTF-8 with or without byte-order mark; lines that begin with "#" and blank lines are skipped; an empty cell is a
    sample that was not recorded (NaN).
    """

    suffixes = (".csv", ".csv.gz", ".tsv", ".tsv.gz")
    format = "delimited text"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        lines = _lines(path)
        start = next((i for i, line in enumerate(lines) if not _skipped(line)), None)
        if start is None:
            raise ExperimentError("the file holds no text: expected a header row and samples below it; export the record again")
        check_samples(len(lines) - start - 1, "the file")
        first = next((line for line in lines[start + 1 :] if not _skipped(line)), "")
        delimiter = _delimiter(lines[start], first)
        names = _header(lines[start], delimiter, start + 1)
        if not first:
            return Columns(names=names, values={name: np.empty(0) for name in names if name in wanted})
        values = _fast(lines[start + 1 :], delimiter, names, wanted)
        if values is None:
            values = parse_cells(lines, start + 1, delimiter, names, wanted)
        return Columns(names=names, values=values)


def _lines(path: Path) -> list[str]:
    """Read, unpack and decode the file, and split it into lines."""
    stored = path.stat().st_size
    packed = path.suffix.lower() == ".gz"
    limit = min(MAX_TEXT_BYTES, allowed_bytes(stored)) if packed else MAX_TEXT_BYTES
    with gzip.open(path, "rb") if packed else path.open("rb") as stream:
        content = stream.read(limit + 1 if packed else min(limit, stored) + 1)
    if len(content) > limit:
        raise ExperimentError(f"the file of {stored} bytes unfolds to more than {limit} bytes: expected less; cut or decimate the record")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ExperimentError(f"line {line} is not UTF-8 text: expected UTF-8; save the file in that encoding") from error
    if "\0" in text:
        raise ExperimentError("the file holds zero bytes: expected UTF-8 text; export it as text in that encoding")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _skipped(line: str) -> bool:
    """Whether a line holds neither header nor samples."""
    bare = line.strip(" ")
    return not bare or bare.startswith("#")


def _cells(line: str, delimiter: str) -> list[str]:
    """Split one line, quotes honoured."""
    return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=delimiter))]


def _delimiter(header: str, first: str) -> str:
    """Choose the delimiter that splits header and first sample into equally many cells, at least two."""
    counts = {mark: len(_cells(header, mark)) for mark in DELIMITERS}
    fitting = [mark for mark, count in counts.items() if count > 1 and (not first or len(_cells(first, mark)) == count)]
    chosen = max(fitting or DELIMITERS, key=lambda mark: counts[mark])
    if counts[chosen] < 2:
        raise ExperimentError(
            f"the header row {shown(header)} has one column only: expected at least two, separated by {listed(DELIMITERS.values())}; "
            "export it so"
        )
    return chosen


def _header(line: str, delimiter: str, number: int) -> tuple[str, ...]:
    """Read the column names."""
    names = tuple(_cells(line, delimiter))
    if any(_is_number(name) for name in names):
        raise ExperimentError(f"line {number} holds numbers where the header row should be: expected column names; add a header row")
    for place, name in enumerate(names):
        if not name:
            raise ExperimentError(f"column {place + 1} has no name in line {number}: expected a name for each; complete the header row")
        if name in names[:place]:
            raise ExperimentError(f"column {shown(name)} is there twice in line {number}: expected different names; rename one")
    return names


def _is_number(cell: str) -> bool:
    """Whether a cell of the header row is in truth a sample."""
    try:
        float(cell)
    except ValueError:
        return False
    return cell.lower() not in ("nan", "inf", "infinity")


def _fast(
    lines: list[str], delimiter: str, names: tuple[str, ...], wanted: AbstractSet[str]
) -> dict[str, Float64[np.ndarray, " samples"]] | None:
    """Let NumPy's C parser try; None where a cell is empty, holds text or is lacking: then the slow way explains or forgives it."""
    try:
        table = np.loadtxt(lines, delimiter=delimiter, comments="#", quotechar='"', ndmin=2)
    except ValueError:
        return None
    if table.shape[1] != len(names):
        return None
    return {name: np.ascontiguousarray(table[:, place]) for place, name in enumerate(names) if name in wanted}
