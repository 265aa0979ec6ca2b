"""Lists of words in a sentence."""

from collections.abc import Sequence


def joined(words: Sequence[str]) -> str:
    """Words joined by commas and, before the last one, "and".

    Example:
        >>> joined(["a", "b", "c"]), joined(["a"]), joined([])
        ('a, b and c', 'a', '')
    """
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)
