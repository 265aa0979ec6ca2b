"""`vibrojax datasets`: which recordings made by others can be fitted, where they come from, and which of them are here."""

import textwrap
from pathlib import Path
from typing import Annotated

import typer

from vibrojax.errors import InputError

EXAMPLE = "Example:  vibrojax datasets --data recordings"
_WIDTH = 118


def datasets(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Only this recipe. Left out: all.", show_default=False)] = None,
    data: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of recordings: say which files are there and match.", show_default=False)
    ] = None,
) -> None:
    """List the recordings that come with a recipe: origin, licence, how to get the files, and their sha256.

    With --data, every file is looked for in DIR (or in the data set's folder below it) and compared. Nothing is downloaded.
    Exit status: 0 listed, whatever is missing; 2 bad input.
    """
    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is not a folder: expected one that holds recordings; correct it or leave it out")
    from identification.recipes.load import load_recipe, recipe_names

    for each in recipe_names() if name is None else (name,):
        typer.echo("\n".join(_lines(load_recipe(each), data)))


def _lines(recipe, data: Path | None) -> list[str]:
    """What is said about one recipe."""
    from identification.recipes.load import PRESENT, recording_states, recordings_folder

    states = {} if data is None else recording_states(recipe, data)
    lines = [
        recipe.name,
        *(_entry(label, getattr(recipe, label)) for label in ("title", "origin", "licence", "citation", "obtain", "expect")),
    ]
    lines += [f"  {states.get(path, 'file'):8}  {digest}  {recipe.data_folder}/{path}" for path, digest in recipe.sha256.items()]
    if data is not None:
        there = sum(state == PRESENT for state in states.values())
        verdict = f"ready: fit-parameters --recipe {recipe.name} --data {data}" if there == len(states) else "not ready"
        lines.append(f"  {there} of {len(states)} files present in {recordings_folder(recipe, data)}; {verdict}")
    return [*lines, ""]


def _entry(label: str, text: str) -> str:
    """A labelled text, wrapped and indented."""
    return textwrap.fill(text, _WIDTH, initial_indent=f"  {label:8}  ", subsequent_indent=" " * 12, break_long_words=False)
