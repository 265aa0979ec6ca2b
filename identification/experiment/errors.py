"""The one error of this layer: an experiment that cannot be used as it stands."""

import difflib
from collections.abc import Iterable

from vibrojax.errors import InputError
from vibrojax.errors import shown as shown


class ExperimentError(InputError):
    r"""An experiment or one of its records is not as the format asks.

    The message is always one line: what was given, what was expected, what to do. White space of any kind in it,
    line breaks that a file name or a library's own message brought along included, is folded to single blanks.

    Args:
        message: the sentence to show.

    Example:
        >>> str(ExperimentError("two\nlines"))
        'two lines'
    """

    def __init__(self, message: str) -> None:
        """Fold the message to one line and keep it."""
        ValueError.__init__(self, " ".join(message.split()))


def suggestion(given: str, accepted: Iterable[str]) -> str:
    """The end of a message, beginning with a colon, that says which accepted word was probably meant, or lists them all.

    Example:
        >>> suggestion("gapp", ["gap", "kind"])
        ": did you mean 'gap'?"
    """
    words = list(accepted)
    near = difflib.get_close_matches(given, words, n=1, cutoff=0.6)
    return f": did you mean {shown(near[0])}?" if near else f": expected one of {listed(words)}"


def check_printable(text: str, what: str) -> str:
    """Refuse a name, `what` says of what, that a report or a terminal cannot show; else give it back.

    Raises:
        ExperimentError: it holds a control character, such as a line break or an escape, or a mark that turns the direction of writing.
    """
    if not text.isprintable():
        raise ExperimentError(f"{what} is {shown(text)}: expected printable characters in one line; rename it")
    return text


def listed(words: Iterable[str], most: int = 20) -> str:
    """Join words for a message, separated by commas; beyond `most` only their count is given, and "none" if there are none.

    Example:
        >>> listed(["m", "mm"]), listed([])
        ('m, mm', 'none')
    """
    every = [word if word.isprintable() and len(word) <= 60 else shown(word) for word in words]
    rest = len(every) - most
    return (", ".join(every[:most]) or "none") + (f" and {rest} more" if rest > 0 else "")
