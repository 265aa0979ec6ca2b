"""The raw files of a recipe: which of them are there, and whether they are those that it was written for."""

from pathlib import Path

from identification.experiment.columns.location import sha256_of
from identification.recipes.base import Recipe
from vibrojax.errors import InputError

PRESENT, MISSING, DIFFERS = "present", "missing", "differs"
SHOWN_DIGITS = 12


def recordings_folder(recipe: Recipe, data: Path) -> Path:
    """Folder that should hold the recipe's raw files: its usual folder below `data` if there is one, else `data` itself."""
    below = data / recipe.data_folder
    return below if below.is_dir() else data


def recording_states(recipe: Recipe, data: Path) -> dict[str, str]:
    """For every raw file of a recipe whether it is `PRESENT`, `MISSING`, or there with other content, `DIFFERS`.

    Args:
        recipe: as loaded.
        data: folder of the data set, or the folder above it.

    Returns:
        State by path in the data set's folder.

    Raises:
        InputError: a file is there and cannot be read.
    """
    folder = recordings_folder(recipe, data)
    return {path: _state(folder / path, wanted) for path, wanted in recipe.sha256.items()}


def find_recordings(recipe: Recipe, data: Path) -> Path:
    """Folder that holds the recipe's raw files, each checked by its digest.

    Args:
        recipe: as loaded.
        data: folder of the data set, or the folder above it.

    Returns:
        The folder.

    Raises:
        InputError: a raw file is missing, cannot be read, or is another than the recipe was written for.
    """
    folder, states = recordings_folder(recipe, data), recording_states(recipe, data)
    missing = [path for path, state in states.items() if state == MISSING]
    if missing:
        what = f"{len(missing)} of {len(states)} files of recipe {recipe.name!r}, the first {missing[0]!r}"
        raise InputError(f"{folder} lacks {what}: get the recordings from {recipe.origin} and name their folder with --data")
    other = next((path for path, state in states.items() if state == DIFFERS), None)
    if other is not None:
        digest = sha256_of(folder / other)
        raise InputError(
            f"{folder / other} is not the file that recipe {recipe.name!r} was written for "
            f"(sha256 {digest[:SHOWN_DIGITS]}…, expected {recipe.sha256[other][:SHOWN_DIGITS]}…): get it again from {recipe.origin}"
        )
    return folder


def _state(file: Path, wanted: str) -> str:
    if not file.is_file():
        return MISSING
    try:
        return PRESENT if sha256_of(file) == wanted else DIFFERS
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}; check its rights") from error
