"""How a text file lays out its samples: delimiter, decimal mark, rows above the samples. Found from the file itself."""

import csv
import io
import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

from identification.experiment.channels import is_unit
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.readers.text import DECIMALS, UNIT_LISTS, is_number, read_preamble

BLANKS = " "
DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", BLANKS: "blanks"}
"""In the order in which they are preferred where two of them would do."""
SAMPLED_ROWS = 200
COMMENT_MARKS = "#%/;! "
COMMENT = re.compile(r"#|(?:%|//)(?![;,\t])")
"""How a comment begins; "%" or "//" alone in a cell is the unit of a column."""
EMPTY = " \t;,\ufeff"


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where the samples of a text file are, and what stands above them.

    Attributes:
        delimiter: one character; a blank stands for any number of them.
        decimal: "." or ",".
        width: cells in a row of samples.
        columns: place and name of every column that has one.
        units: by column name, where a row of units or the preamble states them.
        first: index of the first line of samples; None where there is none.
        end: index past the last line of samples; None where they fill the file's end.
        rate: of sampling, Hz, where the lines above the header row state one.
        own_times: name of the column of time by channel, where each channel has one of its own.
    """

    delimiter: str
    decimal: str
    width: int
    columns: tuple[tuple[int, str], ...]
    units: dict[str, str]
    first: int | None
    end: int | None = None
    rate: float | None = None
    own_times: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that the file offers: of the columns of time that channels have of their own, the first stands for all."""
        further = list(dict.fromkeys(self.own_times.values()))[1:]
        return tuple(name for _, name in self.columns if name not in further)


def skipped(line: str) -> bool:
    """Whether a line holds neither header nor samples: blank, delimiters alone, or a comment."""
    bare = line.strip(EMPTY)
    return not bare or COMMENT.match(bare) is not None


def split(line: str, delimiter: str) -> list[str]:
    """Cells of one line, without surrounding blanks, quotes honoured; a blank as delimiter stands for any number of them.

    Example:
        >>> split('0,5; "a;b" ;', ";")
        ['0,5', 'a;b', '']
    """
    if delimiter == BLANKS:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader(io.StringIO(line.strip(BLANKS)), delimiter=delimiter, skipinitialspace=True))]


def find_layout(lines: list[str]) -> Layout:
    """Find delimiter, decimal mark, header row, row of units and first sample of a text file.

    The samples are the rows of numbers that fill the file's end, but for a footer whose rows begin with a word. Delimiter and decimal mark
    are those under which most of their cells are numbers. The header row is the text above them with as many cells, if need be behind a
    comment mark; a row that names units and stands below it is one of units. What stands higher up is the preamble of the recorder.

    Raises:
        ExperimentError: no text, no two columns, or a header row that does not suit the samples.
    """
    usable = [index for index, line in enumerate(lines) if not skipped(line)]
    if not usable:
        raise ExperimentError("the file holds no text: expected a header row and samples below it; export the record again")
    found = _numbers(lines, usable)
    if found is None:
        return _header_alone(lines, usable)
    delimiter, decimal, width, numeric = found
    table = _Table(lines=lines, usable=usable, delimiter=delimiter, decimal=decimal, width=width, numeric=numeric)
    first = usable[table.begin]
    names, units, above = table.header()
    header = lines[above:first]
    preamble = read_preamble([line for line in (*lines[:above], *table.settings(header)) if line.strip()], delimiter)
    if not names:
        names = preamble.names_for(width) or tuple(f"column {place + 1}" for place in range(width))
    columns = tuple((place, name) for place, name in enumerate(names) if name)
    stated = dict(zip(names, units or preamble.units_for(names), strict=False))
    return Layout(
        delimiter=delimiter,
        decimal=decimal,
        width=width,
        columns=columns,
        units={name: unit for name, unit in stated.items() if name and unit},
        first=first,
        end=table.end(frozenset(line for line in header if not skipped(line))),
        rate=preamble.rate,
    )


def _numbers(lines: list[str], usable: list[int]) -> tuple[str, str, int, frozenset[int]] | None:
    """Delimiter, decimal mark, cells in a row and the columns of numbers, or one column of bare numbers; None where there are none.

    They are looked for in the file's second half; where a long head leaves few rows of samples, in ever shorter parts of its end, most of
    whose cells must then be numbers.
    """
    part = usable[len(usable) // 2 :]
    found = _numbers_of(lines, part, least=0.0)
    while found is None and len(part) > 1:
        part = part[len(part) // 2 :]
        found = _numbers_of(lines, part, least=0.5)
    return found


def _numbers_of(lines: list[str], part: list[int], *, least: float) -> tuple[str, str, int, frozenset[int]] | None:
    """The same for one part of the file, where more than the least share of cells are numbers."""
    sample = [lines[index] for index in part[:: max(1, len(part) // SAMPLED_ROWS)]]
    best, chosen = (least, 0), None
    for delimiter in DELIMITERS:
        rows = [split(line, delimiter) for line in sample]
        width, count = Counter(len(row) for row in rows).most_common(1)[0]
        if width < 2:
            continue
        filled = [[row[place] for row in rows if len(row) == width and row[place]] for place in range(width)]
        for decimal in DECIMALS:
            numbers = [sum(is_number(cell, decimal) for cell in cells) for cells in filled]
            numeric = frozenset(place for place in range(width) if numbers[place] > 0.5 * len(filled[place]))
            score = (count / len(rows) * sum(numbers) / max(sum(map(len, filled)), 1), len(numeric))
            if numeric and score > best:
                best, chosen = score, (delimiter, decimal, width, numeric)
    if chosen is None and 2 * sum(is_number(line.strip(), DECIMALS[0]) for line in sample) > len(sample):
        return BLANKS, DECIMALS[0], 1, frozenset((0,))
    return chosen


def _header_alone(lines: list[str], usable: list[int]) -> Layout:
    """A file without any row of numbers."""
    line = lines[usable[-1]]
    delimiter = max(DELIMITERS, key=lambda mark: len(split(line, mark)) if mark != BLANKS else 1)
    names = tuple(split(line, delimiter))
    if len(names) < 2 or delimiter == BLANKS:
        raise ExperimentError(
            f"line {usable[-1] + 1}, {shown(line)}, has one column only: expected at least two, separated by "
            f"{listed(DELIMITERS.values())}; export it so"
        )
    if len(usable) > 1 and len(split(lines[usable[0]], delimiter)) == len(names):
        raise ExperimentError(
            f"line {usable[-1] + 1} holds no number: expected a row of samples such as 0.001{delimiter} 1.5e-3; export it so"
        )
    return Layout(delimiter=delimiter, decimal=".", width=len(names), columns=tuple(enumerate(names)), units={}, first=None)


@dataclass(frozen=True, kw_only=True)
class _Table:
    """The rows of a file under a known delimiter."""

    lines: list[str]
    usable: list[int]
    delimiter: str
    decimal: str
    width: int
    numeric: frozenset[int]

    def cells(self, row: int) -> list[str]:
        """Cells of a usable line."""
        return split(self.lines[self.usable[row]], self.delimiter)

    @cached_property
    def begin(self) -> int:
        """First row of samples: of the first rows that are, or of a faulty one directly above, which the parser then names."""
        rows = len(self.usable)
        begin = next((row for row in range(rows) if all(self._is_sample(one) for one in range(row, min(row + 3, rows)))), 0)
        while begin > 0 and self._is_faulty(begin - 1):
            begin -= 1
        return begin

    def end(self, header: frozenset[str]) -> int | None:
        """Index of the first line that is no sample of the run: of a header that comes again, or of a footer; None without one.

        A footer, such as "Max", stands below samples that begin with a number or a time of day.
        """
        again = next((index for index in self.usable[self.begin :] if self.lines[index] in header), None)
        if again is not None:
            return again
        end = len(self.usable)
        if self._begins_with_word(self.begin):
            return None
        while self._begins_with_word(end - 1):
            end -= 1
        return self.usable[end] if end < len(self.usable) else None

    def _begins_with_word(self, row: int) -> bool:
        """Whether the first cell of a row begins with a letter and is no number, as "nan" is."""
        first = self.cells(row)[0]
        return first[:1].isalpha() and not is_number(first, self.decimal)

    def _is_sample(self, row: int) -> bool:
        """Whether a row has numbers wherever a column of numbers is filled."""
        cells = self.cells(row)
        if len(cells) != self.width:
            return False
        filled = [cells[place] for place in self.numeric if cells[place]]
        return bool(filled) and all(is_number(cell, self.decimal) for cell in filled)

    def _is_faulty(self, row: int) -> bool:
        """Whether a row is one of samples with a fault: only numbers but too few or many, or mostly numbers, the first among them."""
        cells = self.cells(row)
        numbers = [is_number(cell, self.decimal) for cell in cells]
        if all(number for number, cell in zip(numbers, cells, strict=True) if cell):
            return True
        first = min(self.numeric)
        return len(cells) == self.width and numbers[first] and 2 * sum(numbers[place] for place in self.numeric) >= len(self.numeric)

    def header(self) -> tuple[tuple[str, ...], tuple[str, ...], int]:
        """Names, units, and index of the topmost line that belongs to them; no names where nothing above the samples suits them."""
        rows, last = [], self.begin - 1
        if last > 0 and self._is_mark(last):
            last -= 1
        for row in range(last, max(last - 4, -1), -1):
            cells = self._fitted(self.lines[self.usable[row]])
            if cells is None:
                break
            rows.append((self.usable[row], cells))
        if not rows:
            return self._commented() or self._missing()
        place = next((at for at, (_, cells) in enumerate(rows[:-1]) if is_row_of_units(cells)), None)
        line, names = rows[0 if place is None else place + 1]
        for text in self.lines[line + 1 : self.usable[self.begin]] if place is None else ():  # a comment may state them
            cells = split(text.strip().lstrip(COMMENT_MARKS), self.delimiter)
            if len(cells) == self.width and is_row_of_units(cells):
                return self._named(names, line), tuple(map(bare_unit, cells)), line
        units = () if place is None else tuple("" if cell.lower() in UNIT_LISTS else bare_unit(cell) for cell in rows[place][1])
        return self._named(names, line, numbers=place is not None), units, line

    def _is_mark(self, row: int) -> bool:
        """Whether a row is one word on the samples below it, such as "trace_values", and the row above it is no row of units or numbers."""
        above = self.cells(row - 1)
        word = self.lines[self.usable[row]].strip(" []:;,\t").lower()
        if word not in ("data", "samples", "values", "trace_values") or not 1 < self.width == len(above):
            return False
        return not any(is_number(cell, self.decimal) for cell in above) and (
            row > 1 and len(self.cells(row - 2)) > 1 or not is_row_of_units(above)
        )

    @cached_property
    def _filled(self) -> int:
        """Number of columns up to the last one that holds anything in the first row of samples."""
        return 1 + max((place for place, cell in enumerate(self.cells(self.begin)) if cell), default=max(self.numeric))

    def settings(self, header: list[str]) -> list[str]:
        """What an oscilloscope writes right of its header's columns, above its value or with it, each as "key = value"."""
        beyond = [split(line, self.delimiter)[self._filled :] for line in header]
        pairs = [pair for rows in itertools.pairwise(beyond) for pair in zip(*rows, strict=False)]
        stated = [f"{key} = {value}" for key, value in pairs if key and is_number(value, self.decimal)]
        return stated + [cell for row in beyond for cell in row if "=" in cell]

    def _fitted(self, line: str) -> list[str] | None:
        """The cells of a row above the samples, one for each column; None where it cannot be their header."""
        if self.width == 1:
            return [line.strip()] if re.fullmatch(r"[^,;\t]*[^\W\d_][^,;\t]*", line) else None
        cells = split(line, self.delimiter)
        while len(cells) > self.width and cells[-1].lower() in ("", "comment"):
            cells = cells[:-1]
        beyond = [cell for cell in cells[self._filled :] if cell]
        if beyond and all(cell.lower() in ("start", "increment") or "=" in cell or is_number(cell, self.decimal) for cell in beyond):
            cells = cells[: self._filled] + [""] * (self.width - self._filled)
        if len(cells) == self.width - 1 and self.width - 1 not in self.numeric:
            cells = [*cells, ""]
        if self.delimiter == BLANKS and len(cells) != self.width:
            cells = re.split(r"\s{2,}", line.strip())
        return cells if len(cells) == self.width and any(cells) else None

    def _commented(self) -> tuple[tuple[str, ...], tuple[str, ...], int] | None:
        """The header row where it stands in the comment directly above the samples."""
        found = []
        for index in range(self.usable[self.begin] - 1, -1, -1):
            bare = self.lines[index].strip().lstrip(COMMENT_MARKS)
            cells = split(bare, self.delimiter)
            if not COMMENT.match(self.lines[index].lstrip()) or len(cells) != self.width or any(is_number(c, self.decimal) for c in cells):
                break
            found.append((index, cells))
        if not found:
            return None
        under = len(found) > 1 and is_row_of_units(found[0][1])
        line, names = found[1 if under else 0]
        return self._named(names, line), tuple(map(bare_unit, found[0][1])) if under else (), line

    def _missing(self) -> tuple[tuple[str, ...], tuple[str, ...], int]:
        """No header row: a file of bare numbers, or one whose header does not suit them."""
        begin = self.begin
        if begin > 0 and self.usable[begin - 1] == self.usable[0]:
            names = len(self.cells(begin - 1))
            if names > 1:
                raise ExperimentError(
                    f"line {self.usable[begin] + 1} has {self.width} cells: expected {names}, one for each column of the header row; "
                    "correct the line"
                )
        return (), (), self.usable[begin]

    def _named(self, cells: list[str], line: int, *, numbers: bool = False) -> tuple[str, ...]:
        """The names of all columns: empty for one without name and samples; numbered where several bear one name.

        Above a row of units, `numbers` are names too, those of an oscilloscope's channels.
        """
        if all(is_number(cell, self.decimal) for cell in cells if cell) or (
            not numbers and any(is_number(cell, self.decimal) for cell in cells)
        ):
            raise ExperimentError(
                f"line {line + 1} holds numbers where the header row should be: expected column names; add a header row or correct it"
            )
        names = []
        for place, name in enumerate(cells):
            if not name and place > 0 and place in self.numeric:
                raise ExperimentError(f"column {place + 1} has no name in line {line + 1}: expected one for each; complete the header row")
            bare = name or ("column 1" if place in self.numeric else "")
            names.append(f"{bare} (column {place + 1})" if bare and cells.count(name) > 1 else bare)
        return tuple(names)


def is_row_of_units(cells: list[str]) -> bool:
    """Whether a row names units rather than columns: at least half of what is filled in are known ones.

    Example:
        >>> is_row_of_units(["s", "[mm]", "-"]), is_row_of_units(["Time", "Force"])
        (True, False)
    """
    filled = [bare_unit(cell) for cell in cells if bare_unit(cell)]
    return bool(filled) and 2 * sum(is_unit(cell) for cell in filled) >= len(filled)


def bare_unit(cell: str) -> str:
    """A unit without brackets; empty where a dash stands for none."""
    bare = cell.strip().strip("[]()").strip()
    return "" if bare in ("-", "--", "none") else bare
