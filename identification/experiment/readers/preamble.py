"""What recorders write above the header row of a text file: sampling rate, names and units of channels."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from identification.experiment.readers.numerals import to_number

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
"""Keys of a sampling rate; Hz unless the value says kHz."""
STEPS = ("delta x", "delta t", "sampling interval", "sample interval", "abtastintervall", "intervalo de amostragem")
"""Keys of a sampling step; s unless the value says ms or us."""
FACTORS = {"": 1.0, "hz": 1.0, "khz": 1e3, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "s/s": 1.0}
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

    entries: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def rate(self) -> float | None:
        """Sampling rate, Hz, where the preamble states one."""
        for keys, turned in ((RATES + ((FREQUENCY,) if QUALISYS in self.entries else ()), False), (STEPS, True)):
            for key in keys:
                value = _quantity(self.entries.get(key, ()))
                if value is not None and value > 0.0:
                    return 1.0 / value if turned else value
        return None

    def names_for(self, width: int) -> tuple[str, ...]:
        """Names of all columns that the preamble gives in place of a header row: markers, each with three coordinates; else none."""
        markers = [cell for cell in self.entries.get(MARKERS, ()) if cell]
        names = tuple(f"{marker} {axis}" for marker in markers for axis in AXES)
        if not names or width - len(names) not in (0, 2):
            return ()
        return (("Frame", "Time") if width - len(names) == 2 else ()) + names

    def units_for(self, names: Sequence[str]) -> tuple[str, ...]:
        """Units of the columns, empty where nothing is said."""
        if QUALISYS in self.entries:
            return tuple("mm" if name.endswith(tuple(f" {axis}" for axis in AXES)) else "s" if name == "Time" else "" for name in names)
        return ()


NO_PREAMBLE = Preamble()


def read_preamble(lines: Sequence[str], delimiter: str) -> Preamble:
    """Read the lines above a header row as entries: "key: value", "key = value", a key and cells, or a row of keys above one of numbers.

    Args:
        lines: without blank ones.
        delimiter: of the file.

    Returns:
        The entries; a line that is none is passed over, of two with one key the last counts.

    Example:
        >>> read_preamble(["# Sample rate: 2,5 kHz"], ";").rate
        2500.0
    """
    entries = {}
    for line in lines:
        if found := ENTRY.match(line):
            cells = (
                [cell.strip().strip('"') for cell in found["value"].split(delimiter)] if delimiter.strip(" ") else [found["value"].strip()]
            )
            entries[_key(found["key"])] = tuple(cells)
    for above, below in itertools.pairwise(lines):
        keys, values = (re.split(r"\s*[,;\t]\s*", line.strip(" #%")) for line in (above, below))
        if len(keys) == len(values) > 1 and all(VALUE.fullmatch(value) for value in values):
            entries |= {_key(key): (value,) for key, value in zip(keys, values, strict=True)}
    return Preamble(entries=entries)


def _key(text: str) -> str:
    """A key as it is looked up."""
    return text.strip().lower().replace("_", " ")


def _quantity(cells: Sequence[str]) -> float | None:
    """The number that an entry states, in Hz or s; None without one."""
    text = " ".join(cell for cell in cells[:2] if cell)
    found = VALUE.match(text)
    if found is None:
        return None
    number = to_number(found.group(), ",") if "," in found.group() else to_number(found.group(), ".")
    unit = text[found.end() :].strip(" []()").split(" ")[0].lower()
    return None if number is None else number * FACTORS.get(unit, 1.0)
