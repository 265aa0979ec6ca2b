"""The errors a caller is expected to meet: bad input, and a computation that did not converge; warnings; texts that a terminal can show."""

_LONGEST, _END, _VALUE = 1000, 300, 60
"""Characters of a message, those of them that are kept of its end, where the remedy is, and those of a value in it."""


class InputError(ValueError):
    """What was given cannot be used; the message says what was given, what was expected, and the remedy.

    Raised before any computation starts. The command line turns it into one line and exit status 2.
    """


class NoConvergenceError(RuntimeError):
    """A computation on good input did not reach its tolerance; the message says how far it came.

    The command line turns it into one line and exit status 3.
    """


class WarningLine(str):
    """One line of warning to the user while a command works; a terminal keeps it, where other stages of the work replace one another."""


def printable(text: str) -> str:
    r"""A text with escapes in place of what no terminal shows as it is: control characters, and marks that turn the direction of writing.

    Example:
        >>> printable("a\x1b[31m\u202eb")
        'a\\x1b[31m\\u202eb'
    """
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in text)


def shown(value: object) -> str:
    """A value as it may stand in a message: as Python writes it, cut short.

    Example:
        >>> shown("a" * 1000)[-5:]
        "aaa…'"
    """
    if isinstance(value, str):
        return repr(value if len(value) <= _VALUE else value[:_VALUE] + "…")
    text = repr(value)
    return text if len(text) <= _VALUE else text[:_VALUE] + "…"


def one_line(message: str) -> str:
    r"""A message on one line, printable and of a length that can be read.

    Example:
        >>> one_line("two\nlines")
        'two lines'
        >>> len(one_line("x" * 10_000))
        1000
    """
    line = printable(" ".join(message.split()))
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - _END - 3]} … {line[-_END:]}"
