"""Delimited text, plain or gzip-compressed, as recorders and spreadsheets write it."""

from collections.abc import Set as AbstractSet
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import TIME, means_time
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.cells import parse_cells
from identification.experiment.readers.labview import common_time, find_labview
from identification.experiment.readers.layout import BLANKS, Layout, find_layout
from identification.experiment.readers.limits import check_samples
from identification.experiment.readers.text import read_lines


class DelimitedReader(AbstractReader):
    """Reads columns of numbers, separated by tab, semicolon, comma or blanks, below a header row.

    Decimal point or comma; a row of units below the header row and the recorder's lines above it are understood (`find_layout`); lines
    that begin with "#" and blank lines are skipped; an empty cell is a sample that was not recorded (NaN). Where no column shows the time
    and the recorder states its sampling rate, the column "time" follows from that.
    """

    suffixes = (".csv", ".tsv", ".txt", ".asc", ".lvm", ".csv.gz", ".tsv.gz", ".txt.gz", ".asc.gz", ".lvm.gz")
    format = "delimited text"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        lines, notice = read_lines(path)
        layout, lines = find_labview(lines) or (find_layout(lines), lines)
        names = layout.names
        notices = (notice,) if notice else ()
        if layout.first is None:
            return Columns(names=names, values={name: np.empty(0) for name in names if name in wanted}, notices=notices)
        check_samples(len(lines) - layout.first, "the file")
        rate = layout.preamble.rate
        blank = [name for name in names if means_time(name)] if rate is not None else []
        asked = (wanted & set(names)) | set(blank) | ({names[0]} if rate is not None else set())
        asked |= {own for name, own in layout.own_times.items() if name in wanted}
        values = _fast(lines[layout.first :], layout, asked)
        if values is None:
            values = parse_cells(lines, layout, asked)
        if joined := common_time(values, layout.own_times):
            values[joined[0]] = joined[1]
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
        lines = [line.replace(",", ".") for line in lines]
    try:
        delimiter = None if layout.delimiter == BLANKS else layout.delimiter
        table = np.loadtxt(lines, delimiter=delimiter, comments="#", quotechar='"', ndmin=2)
    except ValueError:
        return None
    if table.shape[1] != layout.width:
        return None
    return {name: np.ascontiguousarray(table[:, place]) for place, name in layout.columns if name in wanted}
