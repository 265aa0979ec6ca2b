"""Bytes that have been damaged, or written to do harm."""

import random
import re
import struct
from collections.abc import Callable

_COUNTS = (0, 1, -1, 2**31 - 1, -(2**31), 2**32 - 1, 2**40, 2**62)
_HOSTILE = (
    b"1e999", b"nan", b"-1", b"0", b"1" * 400, b"null", b"[]", b"{}", b'""', b"true", b"-0.0", b"1e-400", b"[[[[", b"\x00", b"\x1b[31m",
    b'"\\u202e"', b"../../x", b"9**9**9**9", b"a." * 300, b'"' + b"x" * 100_000 + b'"', "é".encode("latin-1"), b"inf",
)  # fmt: skip
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
_TOKEN = re.compile(rb'"[^"\n]{0,80}"|-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|[A-Za-z_][\w.]*')


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Content with one to three changes; those of a text mostly leave it one."""
    ways = (_token, _number) * 10 + _WAYS if content.isascii() else _WAYS
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        content = rng.choice(ways)(content or b"\0", rng)
    return content


def _bit(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    changed[_place(content, rng)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _random_bytes(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    length = rng.randint(1, 16)
    return content[:place] + rng.randbytes(length) + content[place + length :]


def _count(content: bytes, rng: random.Random) -> bytes:
    """A length, an address or a type that is far off."""
    value, place = rng.choice(_COUNTS), _place(content, rng) // 4 * 4
    form = rng.choice(("<q", ">q", "<i", ">i", "<h", "<b"))
    size = struct.calcsize(form)
    number = value & ((1 << 8 * size) - 1)
    return content[:place] + number.to_bytes(size, "little" if form[0] == "<" else "big") + content[place + size :]


def _cut(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content))]


def _left_out(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    return content[:place] + content[place + rng.randint(1, 200) :]


def _twice(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    part = content[place : place + rng.randint(1, 400)]
    return content[:place] + part * rng.randint(2, 50) + content[place:]


def _token(content: bytes, rng: random.Random) -> bytes:
    """A word, a text or a number of a text replaced."""
    found = list(_TOKEN.finditer(content, 0, 200_000))
    if not found:
        return _bit(content, rng)
    one, other = rng.choice(found), rng.choice(found)
    new = rng.choice(_HOSTILE) if rng.random() < 0.5 else other.group()
    return content[: one.start()] + new + content[one.end() :]


def _number(content: bytes, rng: random.Random) -> bytes:
    """A number of a text replaced by another one, which may be a sensible one."""
    found = list(_NUMBER.finditer(content, 0, 200_000))
    if not found:
        return _bit(content, rng)
    one = rng.choice(found)
    value = float(one.group()) * rng.choice((0.5, 1.01, 2.0, -1.0, 1e3, 1e-9, 1e30))
    return content[: one.start()] + repr(value).encode() + content[one.end() :]


def _place(content: bytes, rng: random.Random) -> int:
    """Mostly near the begin, where descriptions are."""
    return rng.randrange(len(content) if rng.random() < 0.4 else min(len(content), 2000))


_WAYS: tuple[Callable[[bytes, random.Random], bytes], ...] = (_bit, _random_bytes, _count, _cut, _left_out, _twice, _token, _token)
