"""TOML from elsewhere, parsed within limits: the parser takes time and memory with the square of a dotted key's parts."""

import re
import tomllib
from typing import Any

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
