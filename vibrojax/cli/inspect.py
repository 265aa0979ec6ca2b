"""`vibrojax inspect` and `vibrojax new`: what recorded files hold, and the experiment file that describes them."""

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.errors import InputError

INSPECT_EXAMPLE = "Example:  vibrojax inspect rig-B --out rig-B/experiment.toml"
NEW_EXAMPLE = "Example:  vibrojax new rig-B"
FILE_NAME = "experiment.toml"


def inspect(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A recorded file, or a folder of them.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Write the proposed experiment file here, in the folder of the records or above it. Left out: it is printed.",
            show_default=False,
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")] = False,
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
    from identification.inspection import template

    _write(target, template())
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
