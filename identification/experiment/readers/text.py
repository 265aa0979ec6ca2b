"""A text file's bytes as lines: unpacked, decoded, control characters refused."""

import gzip
import re
from pathlib import Path

from identification.experiment.errors import ExperimentError
from identification.experiment.readers.limits import MAX_TEXT_BYTES, allowed_bytes

BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
WESTERN = "cp1252"
CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")


def read_lines(path: Path) -> tuple[list[str], str]:
    """Read the lines of a text file, plain or gzip-compressed.

    UTF-8, with or without byte-order mark, and UTF-16 with one; what is neither is read as Windows-1252, which holds what Latin-1 prints.

    Args:
        path: an existing plain file.

    Returns:
        The lines without their ends, and a sentence on the encoding where it had to be guessed; else nothing.

    Raises:
        ExperimentError: too large, or no text.
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
        what = "zero bytes" if found.group() == "\0" else f"a control character, {found.group()!r}, in line {_line(text, found.start())}"
        raise ExperimentError(f"the file holds {what}: expected text in UTF-8; export it as text in that encoding")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), notice


def _decoded(content: bytes) -> tuple[str, str]:
    """The text, and a notice where its encoding was guessed."""
    try:
        return content.decode(BYTE_ORDER_MARKS.get(content[:2], "utf-8-sig")), ""
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        try:
            return content.decode(WESTERN), "The file is not UTF-8; it was read as Windows-1252 (Latin-1)."
        except UnicodeDecodeError:
            raise ExperimentError(f"line {line} is not UTF-8 text: expected UTF-8; save the file in that encoding") from error


def _line(text: str, place: int) -> int:
    """Number of the line, from 1, that holds a place."""
    return text.count("\n", 0, place) + 1
