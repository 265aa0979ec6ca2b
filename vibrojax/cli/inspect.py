"""What there is to fit: `vibrojax inspect` and `new` for recorded files, `vibrojax datasets` for recordings made by others."""

import os
import textwrap
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.cli.options import Quiet
from vibrojax.data_files import data_path
from vibrojax.errors import InputError

INSPECT_EXAMPLE = "Example:  vibrojax inspect rig-B --out rig-B/experiment.toml"
NEW_EXAMPLE = "Example:  vibrojax new rig-B"
DATASETS_EXAMPLE = "Example:  vibrojax datasets --data recordings"
FILE_NAME = "experiment.toml"
_WIDTH = 118
"""Characters of a line on a data set."""


def inspect(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A recorded file, or a folder of them.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Write the proposed experiment file here, in the folder of the records or above it. Left out: it is printed.",
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Show what recorded files hold, and propose an experiment.toml for them.

    Shows columns, units, samples, duration, rate and its jitter, gaps and repeated time stamps, range, noise and saturation. What the
    proposal guesses is marked as a guess; mass and gaps are left to fill in.
    Exit status: 0 done, 2 bad input.
    """
    folder = path if path.is_dir() else path.parent
    target = None if out is None else _target(out)
    if target is not None:
        if not folder.resolve().is_relative_to(target.parent.resolve()):
            raise InputError(f"--out {out} lies outside the folder of the records: expected it in {folder} or above; correct it")
        folder = target.parent
    from identification.inspection import inspect_path, propose, summary

    found = inspect_path(path)
    text = propose(found, folder)
    console = Console(quiet=quiet, highlight=False)
    console.print(summary(found))
    if target is None:
        console.print(text, markup=False, soft_wrap=True)
        return
    _write(target, text)
    console.print(f"{target} written; fill in the lines that say TO FILL IN, and check the guesses", soft_wrap=True)


def new(
    directory: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of the experiment, made if it is not there.")] = Path("."),
) -> None:
    """Write an experiment.toml to start from: every key with its unit and meaning.

    Exit status: 0 written, 2 bad input; a file that is there is never overwritten.
    """
    target = _target(directory / FILE_NAME)
    _write(target, data_path("template.toml").read_text(encoding="utf-8"))
    typer.echo(f"{target} written; put the recorded files beside it and adapt it")


def _target(out: Path) -> Path:
    """The file to write; refused early where it could not be written later."""
    target = out / FILE_NAME if out.is_dir() else out
    if target.suffix.lower() != ".toml":
        raise InputError(f"--out {out} is neither a folder nor a .toml file: expected one, such as {FILE_NAME}; correct it")
    if os.path.lexists(target):
        raise InputError(f"{target} exists: expected a file that is not there yet, so that nothing is lost; remove it or name another")
    return target


def _write(target: Path, text: str) -> None:
    """Write a file that was not there."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except OSError as error:
        raise InputError(f"cannot write {target}: {error.strerror}; name another place") from error


def datasets(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Only this recipe. Left out: all.")] = None,
    data: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of recordings: say which files are there and match.")] = None,
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
