"""Inspection of a recorded file or folder: columns, units, kinds and problems."""

from dataclasses import dataclass, replace
from pathlib import Path

from identification.experiment.errors import ExperimentError, listed
from identification.experiment.readers import READERS, check_suffix
from identification.inspection.columns import FileColumns, read_file
from identification.inspection.facts import ColumnFacts, TimeFacts, column_facts, time_facts
from identification.inspection.kind import Guess, guess_kind
from identification.inspection.mapping import Mapped, map_columns, matched


@dataclass(frozen=True, kw_only=True, eq=False)
class Inspected:
    """One inspected file.

    Attributes:
        found: its columns.
        time: facts of its time stamps.
        columns: facts of every usable column.
        mapped: the columns that seem to be channels.
        guess: what kind of record it seems to be.
    """

    found: FileColumns
    time: TimeFacts
    columns: tuple[ColumnFacts, ...]
    mapped: tuple[Mapped, ...]
    guess: Guess


@dataclass(frozen=True, kw_only=True, eq=False)
class Inspection:
    """All inspected files.

    Attributes:
        folder: that holds the files.
        files: those that could be read.
        failed: why another could not, by name.
    """

    folder: Path
    files: tuple[Inspected, ...]
    failed: dict[str, str]


def inspect_path(path: Path) -> Inspection:
    """Inspect a file, or every file in a folder whose suffix has a reader.

    Args:
        path: of the file or folder.

    Returns:
        What was found.

    Raises:
        ExperimentError: there is nothing there that can be read; for a folder, the first file's reason.
    """
    try:
        paths = sorted(each for each in path.iterdir() if each.is_file() and _known(each)) if path.is_dir() else [path]
        there = path.exists()
    except (OSError, ValueError) as error:
        raise ExperimentError(f"{path} cannot be opened: {error}; give a recorded file or a folder of them") from error
    if not there:
        raise ExperimentError(f"{path} does not exist: expected a recorded file or a folder of them; check the path")
    if not paths:
        suffixes = listed(suffix for reader in READERS for suffix in reader.suffixes)
        raise ExperimentError(f"the folder {path} holds no recorded file: expected one of {suffixes}; check the path")
    check_suffix(paths[0].name)
    files, failed = [], {}
    for each in paths:
        try:
            files.append(_inspected(read_file(each)))
        except ExperimentError as error:
            failed[each.name] = str(error)
    if not files:
        raise ExperimentError(next(iter(failed.values())))
    return Inspection(folder=path if path.is_dir() else path.parent, files=tuple(files), failed=failed)


def _known(path: Path) -> bool:
    """Whether a file's suffix has a reader."""
    return any(path.name.lower().endswith(suffix) for reader in READERS for suffix in reader.suffixes)


def _inspected(found: FileColumns) -> Inspected:
    """Inspect one file."""
    time = time_facts(found)
    mapped = map_columns(found.columns)
    mapped = mapped if time.problem else matched(found.seconds, mapped)
    guess = Guess(kind="drop-test", why="its time stamps are unusable, so nothing could be determined")
    if not time.problem:
        guess = guess_kind(found.seconds, mapped)
    if found.untimed and guess.sine is not None:
        guess = replace(guess, why="the cart moves as a sine; without time stamps its frequency is not known")
    return Inspected(
        found=found,
        time=time,
        columns=tuple(column_facts(column) for column in found.columns),
        mapped=mapped,
        guess=guess,
    )
