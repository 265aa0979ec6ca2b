"""The parts of pages that are generated from the program itself."""

from collections.abc import Callable

from catalogue import catalogue
from commands import commands

PAGES: dict[str, tuple[str, Callable[[], str]]] = {
    "cli.md": ("<!-- commands -->", commands),
    "effects.md": ("<!-- catalogue -->", catalogue),
}
"""Page -> the mark that is replaced, and what writes the text for it."""


def filled(page: str, markdown: str) -> str:
    """The page's text with its mark replaced. Raises `ValueError` where the mark is not there exactly once."""
    mark, write = PAGES[page]
    if markdown.count(mark) != 1:
        raise ValueError(f"docs/{page} holds {markdown.count(mark)} marks {mark}: expected one; put it where the generated text belongs")
    return markdown.replace(mark, write())
