"""LabVIEW measurement files: entries on the file, entries on the channels, a header row, then samples with a comment in some rows."""

import re

from identification.experiment.channels import TIME
from identification.experiment.errors import ExperimentError
from identification.experiment.readers.layout import EMPTY, SAMPLED_ROWS, Layout, skipped, split
from identification.experiment.readers.text import DECIMALS, is_number, read_preamble

ABSCISSA = "X_Value"


def find_labview(lines: list[str]) -> tuple[Layout, list[str]] | None:
    """Layout of a LabVIEW measurement file, and its lines with the comments of the rows of samples cut off.

    None where the file is none of LabVIEW's with a header; refused is one that holds several segments.
    """
    headers = _header_rows(lines)
    if not headers:
        return None
    if len(headers) > 1:
        raise ExperimentError(
            f"the file holds {len(headers)} segments, the second has its columns in line {headers[1][0] + 1}: expected one, "
            "since each segment has a time axis of its own; export each segment as a file of its own, or cut the file above its head"
        )
    ((header, delimiter),) = headers
    cells = split(lines[header].rstrip(EMPTY), delimiter)
    commented = cells[-1] == "Comment"
    cells = cells[:-1] if commented else cells
    entries = {row[0]: row[1:] for row in (split(line, delimiter) for line in lines[:header])}
    decimal = _decimal(lines[header + 1 :], delimiter, len(cells), "".join(entries.get("Decimal_Separator", ())))
    body = [_without_comment(line, delimiter, decimal, len(cells)) for line in lines[header + 1 :]] if commented else lines[header + 1 :]
    names = _names(cells)
    layout = Layout(
        delimiter=delimiter,
        decimal=decimal,
        width=len(cells),
        columns=tuple(enumerate(names)),
        units=_units(cells, names, entries),
        first=None if all(map(skipped, body)) else header + 1,
        rate=read_preamble([line for line in lines[:header] if line.strip()], delimiter).rate,
        own_times=_own_times(cells, names),
    )
    return layout, lines[: header + 1] + body


def _header_rows(lines: list[str]) -> list[tuple[int, str]]:
    """Index and delimiter of the header row of each segment: the first line with text below the end of a header."""
    ends = [index for index, line in enumerate(lines) if line.startswith("***End_of_Header***")]
    below = [next((index for index in range(end + 1, len(lines)) if lines[index].strip(EMPTY)), end) for end in ends]
    found = [(index, re.match(r"X_Value *(?P<delimiter>[\t,;])", lines[index])) for index in below]
    return [(index, row["delimiter"]) for index, row in found if row]


def _decimal(rows: list[str], delimiter: str, width: int, stated: str) -> str:
    """The decimal mark under which most cells of the samples are numbers; the stated one where several would do, else a point."""
    marks = [mark for mark in (stated, *DECIMALS) if mark in DECIMALS and mark != delimiter]
    sample = [cell for row in rows[:: max(1, len(rows) // SAMPLED_ROWS)] for cell in split(row, delimiter)[:width]]
    return max(marks, key=lambda mark: sum(is_number(cell, mark) for cell in sample))


def _without_comment(line: str, delimiter: str, decimal: str, width: int) -> str:
    """A row of samples without its comment, which may hold delimiters; one with too many numbers stays, for the parser to refuse."""
    if line.count(delimiter) < width:
        return line
    cells = line.split(delimiter)
    if len(cells) > width + 1 and is_number(cells[width].strip(), decimal):
        return line
    return delimiter.join(cells[:width])


def _names(cells: list[str]) -> list[str]:
    """Names of all columns, numbered where several bear one; of several X_Value columns, the first is offered as "time" for all."""
    names = [name or f"column {place + 1}" for place, name in enumerate(cells)]
    unique = [f"{name} (column {place + 1})" if names.count(name) > 1 else name for place, name in enumerate(names)]
    return [TIME, *unique[1:]] if cells.count(ABSCISSA) > 1 and TIME not in names else unique


def _own_times(cells: list[str], names: list[str]) -> dict[str, str]:
    """The column of time before each channel, by the channel's name; none where one column serves all channels."""
    if cells.count(ABSCISSA) < 2:
        return {}
    before = [max(at for at in range(place + 1) if cells[at] == ABSCISSA) for place in range(len(cells))]
    return {name: names[before[place]] for place, name in enumerate(names) if cells[place] != ABSCISSA}


def _units(cells: list[str], names: list[str], entries: dict[str, list[str]]) -> dict[str, str]:
    """Units by column name.

    The entries of a line belong to the channels in their order. Where an X_Value stands between two channels, an empty cell stands between
    their entries: the counts of samples, which no channel lacks, tell which cells are the channels'.
    """
    channels = [place for place, cell in enumerate(cells) if cell != ABSCISSA]
    filled = [place for place, count in enumerate(entries.get("Samples", ())) if count]
    at = filled if len(filled) == len(channels) else [place - 1 for place in channels]
    labels = entries.get("Y_Unit_Label", ())
    found = {names[place]: labels[cell] for place, cell in zip(channels, at, strict=True) if cell < len(labels) and labels[cell]}
    return {name: "s" for name, cell in zip(names, cells, strict=True) if cell == ABSCISSA} | found
