"""What a file from elsewhere may claim, and where it may lie: the defence against damaged files and those made to do harm."""

import hashlib
import math
import re
import sys
import tomllib
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from identification.experiment.errors import ExperimentError, check_printable, shown

MAX_SAMPLES = 50_000_000
MAX_TEXT_BYTES = 4 * 2**30
LARGEST = math.sqrt(sys.float_info.max / MAX_SAMPLES) / 2**16
"""A larger number counts as missing: units, differences and sums of squares of up to this one stay finite in double precision."""
# A measured signal carries noise and never shrinks a hundredfold; small files are let through whatever their ratio.
MAX_RATIO = 100
FREE_BYTES = 64 * 2**20
# For a file that is read in a process of its own: what the libraries take to start with, and far more than any of them needs for a byte.
FREE_SECONDS, BYTES_PER_SECOND = 15, 1_000_000
FREE_MEMORY, COPIES = 2**30, 3


def allowed_bytes(stored_bytes: int) -> int:
    """Number of bytes that a file may unfold to.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in bytes.

    Example:
        >>> allowed_bytes(10) == FREE_BYTES
        True
    """
    return max(FREE_BYTES, MAX_RATIO * stored_bytes)


def check_samples(samples: int, what: str) -> None:
    """Refuse more samples than a record may have.

    Args:
        samples: as the file claims.
        what: for the message.

    Raises:
        ExperimentError: more than `MAX_SAMPLES`.
    """
    if samples > MAX_SAMPLES:
        raise ExperimentError(f"{what} claims {samples} samples: expected at most {MAX_SAMPLES}; cut or decimate the record")


def check_claim(claimed_bytes: int, stored_bytes: int, what: str) -> None:
    """Refuse a claim that the file's own size cannot back.

    Args:
        claimed_bytes: memory that reading would take.
        stored_bytes: size of the file.
        what: for the message.

    Raises:
        ExperimentError: the claim is beyond `allowed_bytes`.
    """
    if claimed_bytes > allowed_bytes(stored_bytes):
        raise ExperimentError(
            f"{what} claims {claimed_bytes} bytes in a file of {stored_bytes} bytes: expected at most {allowed_bytes(stored_bytes)}; "
            "the file is damaged, export it again"
        )


def allowed_seconds(stored_bytes: int) -> int:
    """Processor time that reading a file may take.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in s.

    Example:
        >>> allowed_seconds(3_000_000)
        18
    """
    return FREE_SECONDS + stored_bytes // BYTES_PER_SECOND


def allowed_memory(stored_bytes: int) -> int:
    """Memory that reading a file may take: some copies of what it may unfold to.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in bytes.
    """
    return FREE_MEMORY + COPIES * allowed_bytes(stored_bytes)


MAX_BYTES = 4_000_000
"""Some ten thousand records."""
MOST_PARTS = 16
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


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
    """Resolve a record's path and check that it stays inside the folder.

    Args:
        folder: the experiment's folder.
        file: relative path as written in the experiment file.

    Returns:
        The path; the file need not exist.

    Raises:
        ExperimentError: the path is absolute, climbs out with "..", holds control characters, or a link leads out of the folder.
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
    """Say whether a record's file is there.

    Args:
        path: from `record_path`.
        file: as written, for the message.

    Returns:
        False where nothing bears that name.

    Raises:
        ExperimentError: something bears it that is not a plain file.
    """
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
    """Digest a file's bytes.

    Args:
        path: the file.

    Returns:
        sha256 in hexadecimal.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
