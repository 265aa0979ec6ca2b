"""Lists of words in a sentence."""

from collections.abc import Iterable, Sequence


def joined(words: Sequence[str]) -> str:
    """Words joined by commas and, before the last one, "and".

    Example:
        >>> joined(["a", "b", "c"]), joined(["a"]), joined([])
        ('a, b and c', 'a', '')
    """
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


def grouped(said: Iterable[tuple[str, str]]) -> list[str]:
    """What is said of something, once for all of which the same is said.

    Example:
        >>> grouped([("a.csv", "too short"), ("b.csv", "one gap"), ("c.csv", "too short")])
        ['a.csv and c.csv: too short', 'b.csv: one gap']
    """
    subjects: dict[str, list[str]] = {}
    for subject, words in said:
        subjects.setdefault(words, []).append(subject)
    return [f"{joined(those)}: {words}" for words, those in subjects.items()]
