"""What a file from elsewhere may claim, and where it may lie: the defence against damaged files and those made to do harm.

Readers refuse, before they allocate, more samples, memory or text than a record can have (`check_samples`, `check_claim`, `check_shape`,
`check_numeric`); the process that reads for compiled libraries has limits on memory and time (`limit_process`); TOML is short
and shallow (`parse_limited`); and a record lies inside its experiment's folder (`record_path`).
"""

import hashlib
import math
import re
import sys
import tomllib
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np

from identification.experiment.errors import ExperimentError, check_printable, shown

MAX_SAMPLES = 50_000_000
MAX_TEXT_BYTES = 4 * 2**30
LARGEST = math.sqrt(sys.float_info.max / MAX_SAMPLES) / 2**16
"""A larger number counts as missing: units, differences and sums of squares of up to this one stay finite in double precision."""
MAX_BYTES = 4_000_000
"""Of a TOML text: some ten thousand records."""
MOST_PARTS = 16
"""Of a dotted key: the parser takes time and memory with the square of their number."""
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


def check_samples(samples: int, what: str) -> None:
    """Refuse more samples than a record may have; `what` claims them, for the message."""
    if samples > MAX_SAMPLES:
        raise ExperimentError(f"{what} claims {samples} samples: expected at most {MAX_SAMPLES}; cut or decimate the record")


def check_claim(claimed_bytes: int, stored_bytes: int) -> None:
    """Refuse to read a file that would take more memory than its own size can back."""
    if claimed_bytes > allowed_bytes(stored_bytes):
        raise ExperimentError(
            f"the file claims {claimed_bytes} bytes in a file of {stored_bytes} bytes: expected at most {allowed_bytes(stored_bytes)}; "
            "the file is damaged, export it again"
        )


def check_shape(shape: tuple[int, ...], name: str) -> None:
    """Refuse a shape that is no column, or too many samples, before anything is allocated; `name` is the column's."""
    samples = math.prod(map(int, shape))
    check_samples(samples, f"column {shown(name)}")
    if len(shape) == 0 or (samples > 0 and max(shape) != samples):
        raise ExperimentError(f"column {shown(name)} has shape {tuple(shape)}: expected one dimension; store one array per channel")


def check_numeric(dtype: np.dtype, name: str) -> None:
    """Refuse a type that holds no real numbers: text, objects, complex or logical values, structures."""
    if dtype.kind not in "iuf":
        raise ExperimentError(f"column {shown(name)} holds {dtype}: expected integers or real numbers; store it as float64")


def allowed_bytes(stored_bytes: int) -> int:
    """Bytes that a file of so many may unfold to: a measured signal never shrinks a hundredfold, and small files are let through."""
    return max(64 * 2**20, 100 * stored_bytes)


def allowed_seconds(stored_bytes: int) -> int:
    """Processor time that reading a file of so many bytes may take, s: libraries take some to start with, and far less for a byte."""
    return 15 + stored_bytes // 1_000_000


def allowed_memory(stored_bytes: int) -> int:
    """Bytes of memory that reading a file may take: some copies of what it may unfold to."""
    return 2**30 + 3 * allowed_bytes(stored_bytes)


def limit_process(stored_bytes: int) -> None:
    """From here on this process has so much memory and time as a file of so many bytes may take."""
    import resource  # not there on every system

    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    memory, seconds = pages * resource.getpagesize() + allowed_memory(stored_bytes), allowed_seconds(stored_bytes)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def parse_limited(text: str) -> dict[str, Any]:
    """Parse a TOML text that may have been written to do harm.

    Raises:
        ValueError: it is not TOML, is nested too deeply, or holds a dotted key of more than `MOST_PARTS` parts; with its line.

    Example:
        >>> parse_limited("a.b = 1")
        {'a': {'b': 1}}
        >>> parse_limited("a." * 16 + "a = 1")
        Traceback (most recent call last):
        ValueError: a dotted key has more than 16 parts (at line 1)
    """
    if (long := _LONG_KEY.search(text)) is not None:
        raise ValueError(f"a dotted key has more than {MOST_PARTS} parts (at line {text.count(chr(10), 0, long.start()) + 1})")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("tables or lists are nested too deeply") from error


def record_path(folder: Path, file: str) -> Path:
    """Resolve a record's path, as written in the experiment file, and check that it stays inside the folder; it need not exist.

    Refused is a path that is absolute, climbs out with "..", holds control characters, or leads out of the folder through a link.
    """
    remedy = "expected a path inside the experiment's folder; put the file there"
    windows = PureWindowsPath(file)
    if PurePosixPath(file).is_absolute() or windows.drive or windows.root or ".." in windows.parts:
        raise ExperimentError(f"record {shown(file)} lies outside the experiment's folder: {remedy}")
    try:
        path = (folder / file).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise ExperimentError(f"record {shown(file)} is not a usable path ({error}): {remedy}") from error
    check_printable(file, "the path of a record")
    if not path.is_relative_to(folder.resolve()):
        raise ExperimentError(f"record {shown(file)} leads out of the experiment's folder through a link: {remedy}")
    return path


def file_exists(path: Path, file: str) -> bool:
    """Whether a record's file is there; what bears its name and is no plain file is refused. `file` is the name for the message."""
    try:
        if path.is_file():
            return True
        there = path.exists()
    except OSError as error:
        raise ExperimentError(f"record {shown(file)} cannot be opened ({error.strerror or error}): check its name and rights") from error
    if there:
        raise ExperimentError(f"record {shown(file)} is not a file: expected a file with recorded data; check its name")
    return False


def sha256_of(path: Path) -> str:
    """sha256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
