"""Text of a record file: its lines, numbers with decimal point or comma, times of day, and what recorders write above the header row."""

import gzip
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError
from identification.experiment.limits import MAX_TEXT_BYTES, allowed_bytes

CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")


def read_lines(path: Path) -> tuple[list[str], str]:
    """Lines of a text file, plain or gzip-compressed, without their ends, and a sentence on the encoding where it had to be guessed.

    UTF-8, with or without byte-order mark, and UTF-16 with one; what is neither is read as Windows-1252, which holds what Latin-1 prints.
    A file that is too large, or no text, is refused.
    """
    stored = path.stat().st_size
    packed = path.suffix.lower() == ".gz"
    limit = min(MAX_TEXT_BYTES, allowed_bytes(stored)) if packed else MAX_TEXT_BYTES
    with gzip.open(path, "rb") if packed else path.open("rb") as stream:
        content = stream.read(limit + 1 if packed else min(limit, stored) + 1)
    if len(content) > limit:
        raise ExperimentError(f"the file of {stored} bytes unfolds to more than {limit} bytes: expected less; cut or decimate the record")
    text, notice = _decoded(content)
    if found := CONTROL.search(text):
        line = text.count("\n", 0, found.start()) + 1
        what = "zero bytes" if found.group() == "\0" else f"a control character, {found.group()!r}, in line {line}"
        raise ExperimentError(f"the file holds {what}: expected text in UTF-8; export it as text in that encoding")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), notice


def _decoded(content: bytes) -> tuple[str, str]:
    """The text, and a notice where its encoding was guessed."""
    try:
        return content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"), ""
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        try:
            return content.decode("cp1252"), "The file is not UTF-8; it was read as Windows-1252 (Latin-1)."
        except UnicodeDecodeError:
            raise ExperimentError(f"line {line} is not UTF-8 text: expected UTF-8; save the file in that encoding") from error


DECIMALS = (".", ",")
_NUMBERS = {
    mark: re.compile(
        rf"[-+]?(?:\d+(?:\{mark}\d*)?|\{mark}\d+|[1-9]\d{{0,2}}(?:\{group}\d{{3}})+\{mark}\d+)(?:[de][-+]?\d+)?|[-+]?(?:nan|inf|infinity)",
        re.IGNORECASE,
    )
    for mark, group in zip(DECIMALS, reversed(DECIMALS), strict=True)
}
OVERLOAD = re.compile("[-+\u2212]?\u221e")
"""As oscilloscopes print it, the sign of infinity."""


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell without surrounding blanks is a number under a decimal mark, "." or ","; "nan", "inf" and the sign of infinity are.

    Fortran's exponents are numbers ("1.5D-03"), and marks between thousands where a decimal mark follows them.

    Example:
        >>> is_number("-1,5e-3", ","), is_number("1_0", "."), is_number("1.234,5", ","), is_number("1.234", ","), is_number("-\u221e", ".")
        (True, False, True, False, True)
    """
    return (cell.isascii() and _NUMBERS[decimal].fullmatch(cell) is not None) or OVERLOAD.fullmatch(cell) is not None


def to_number(cell: str, decimal: str) -> float | None:
    """The number that a cell is under a decimal mark; None where it is none."""
    if not is_number(cell, decimal):
        return None
    if OVERLOAD.fullmatch(cell):
        return float("inf") if cell[0] in "+\u221e" else -float("inf")
    plain = cell.replace(".", "").replace(",", ".") if decimal == "," else cell.replace(",", "")
    return float(re.sub("[dD]", "e", plain))


CLOCK = re.compile(
    r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T])?(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2}(?:[.,]\d+)?)"
    r"(?: ?(?:Z|[+-]\d{2}:?\d{2}|(?P<half>[AaPp])[Mm]))?"
)


def is_clock(cell: str) -> bool:
    """Whether a cell without surrounding blanks is a time of day, with or without a date before it.

    Example:
        >>> is_clock("2024-03-01 10:11:12.345"), is_clock("10:11")
        (True, False)
    """
    return CLOCK.fullmatch(cell) is not None


def seconds_of(cells: Sequence[str]) -> Float64[np.ndarray, " samples"]:
    """Seconds since the first of a column's stamps, NaN where a cell is no time of day.

    A stamp more than half a day earlier than the one before belongs to the next day.

    Example:
        >>> seconds_of(["23:59:59,5", "00:00:00,5"]).tolist()
        [0.0, 1.0]
    """
    found = [CLOCK.fullmatch(cell) for cell in cells]
    whole = np.array([np.nan if one is None else _second_of_day(one) for one in found])
    part = np.array([0.0 if one is None else float("0" + one["s"][2:].replace(",", ".")) for one in found])
    usable = np.flatnonzero(np.isfinite(whole))
    if usable.size:
        days = np.cumsum(np.diff(whole[usable], prepend=whole[usable[0]]) < -43200.0)
        whole[usable] = whole[usable] - whole[usable[0]] + 86400.0 * days
        part -= part[usable[0]]
    return whole + part


def _second_of_day(stamp: re.Match[str]) -> float:
    """Of a stamp of twenty-four hours, or of twelve with AM or PM; whole seconds."""
    hour = int(stamp["h"]) if stamp["half"] is None else int(stamp["h"]) % 12 + (12 if stamp["half"] in "Pp" else 0)
    return 60.0 * (60.0 * hour + int(stamp["m"])) + int(stamp["s"][:2])


RATES = (
    "sample rate",
    "samplerate",
    "sampling rate",
    "sampling frequency",
    "sample frequency",
    "data rate",
    "abtastrate",
    "abtastfrequenz",
    "messrate",
    "taxa de amostragem",
    "frequencia de amostragem",
    "frequência de amostragem",
)
"""Keys of a sampling rate, Hz unless the value states a unit of `HERTZ`."""
STEPS = (
    "delta x",
    "delta t",
    "dt",
    "x-axis delta",
    "increment",
    "tinc",
    "sampling interval",
    "sample interval",
    "abtastintervall",
    "intervalo de amostragem",
)
"""Keys of a sampling step, s unless the value states a unit of `SECONDS`."""
HERTZ = {"": 1.0, "hz": 1.0, "1/s": 1.0, "s/s": 1.0, "sa/s": 1.0, "sps": 1.0, "samples/s": 1.0, "khz": 1e3, "ks/s": 1e3, "mhz": 1e6}
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "\u03bcs": 1e-6, "usec": 1e-6, "ns": 1e-9}
UNIT_LISTS, SCOPE_UNITS = ("units", "unit", "einheiten", "einheit", "unidades", "unites"), ("horizontal units", "vertical units")
"""Keys of the units of all columns, in a comment or above the header row, and of those of an oscilloscope."""
ENTRY = re.compile(r"^[\s#%/;!\"]*(?P<key>[^:=\t;,\"]+?)\"?\s*[:=\t;,]\s*(?P<value>.*)$")
VALUE = re.compile(r"[-+\d.,eE]+")
# Qualisys Track Manager, which writes millimetres.
QUALISYS, MARKERS, FREQUENCY, AXES = "no of frames", "marker names", "frequency", ("X", "Y", "Z")


@dataclass(frozen=True, kw_only=True)
class Preamble:
    """The entries above a header row.

    Attributes:
        entries: cells by key, which is in lower case and with blanks for underscores.
    """

    entries: dict[str, tuple[str, ...]]

    @property
    def rate(self) -> float | None:
        """Sampling rate, Hz, where the preamble states one."""
        for keys, factors, turned in ((RATES + ((FREQUENCY,) if QUALISYS in self.entries else ()), HERTZ, False), (STEPS, SECONDS, True)):
            for key in keys:
                value = _quantity(self.entries.get(key, ()), factors)
                if value is not None and value > 0.0:
                    return 1.0 / value if turned else value
        return None

    def names_for(self, width: int) -> tuple[str, ...]:
        """Names of all columns that the preamble gives in place of a header row: a list, or markers of three coordinates; else none."""
        if len(listed := self.entries.get("channel names", ())) == width:
            return listed
        markers = [cell for cell in self.entries.get(MARKERS, ()) if cell]
        names = tuple(f"{marker} {axis}" for marker in markers for axis in AXES)
        if not names or width - len(names) not in (0, 2):
            return ()
        return (("Frame", "Time") if width - len(names) == 2 else ()) + names

    def units_for(self, names: Sequence[str]) -> tuple[str, ...]:
        """Units of the columns, empty where nothing is said."""
        if QUALISYS in self.entries:
            return tuple("mm" if name.endswith(tuple(f" {axis}" for axis in AXES)) else "s" if name == "Time" else "" for name in names)
        listed = next((self.entries[key] for key in UNIT_LISTS if key in self.entries), ())
        if len(listed) == 1:
            listed = tuple(re.split(r"\s*[,;]\s*|\s+", listed[0]))
        scope = (*self.entries.get(SCOPE_UNITS[0], ())[:1], *self.entries.get(SCOPE_UNITS[1], ()))
        return next((tuple(each.strip("[]()") for each in one) for one in (listed, scope) if len(one) == len(names)), ())


def read_preamble(lines: Sequence[str], delimiter: str) -> Preamble:
    """Read the lines above a header row as entries: "key: value", "key = value", a key and cells, or keys above a row of their values.

    A line that is none is passed over; of two with one key the last counts.

    Example:
        >>> read_preamble(["# Sample rate: 2,5 kHz"], ";").rate
        2500.0
    """
    entries = {}
    for line in lines:
        if found := ENTRY.match(line):
            entries[_key(found["key"])] = _values(found["value"], delimiter)
    for above, below in itertools.pairwise(lines):
        if (found := ENTRY.match(above)) and not found["value"]:
            entries[_key(found["key"])] = _values(below, delimiter)
        keys, values = (re.split(r"\s*[,;\t]\s*", line.strip(" #%")) for line in (above, below))
        if len(keys) == len(values) > 1 and all(VALUE.fullmatch(value) for value in values):
            entries |= {_key(key): (value,) for key, value in zip(keys, values, strict=True)}
    return Preamble(entries=entries)


def _values(text: str, delimiter: str) -> tuple[str, ...]:
    """The cells of an entry."""
    return tuple(cell.strip().strip('"') for cell in text.split(delimiter)) if delimiter.strip(" ") else (text.strip(),)


def _key(text: str) -> str:
    """A key as it is looked up."""
    return text.strip().lower().replace("_", " ")


def _quantity(cells: tuple[str, ...], factors: dict[str, float]) -> float | None:
    """The number that an entry states, with a unit of the factors or without one; None where there is none, or several that differ."""
    filled = [cell for cell in cells if cell]
    several = len(filled) > 1 and all(VALUE.fullmatch(cell) for cell in filled)  # one for each channel
    if several and len(set(filled)) > 1:
        return None
    text = " ".join(filled[: 1 if several else 2])
    found = VALUE.match(text)
    if found is None:
        return None
    number = to_number(found.group(), ",") if "," in found.group() else to_number(found.group(), ".")
    factor = factors.get(text[found.end() :].strip(" []()").split(" ")[0].lower().rstrip(".,;"))
    return None if number is None or factor is None else number * factor
