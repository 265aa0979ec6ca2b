"""From a recipe and a folder of recordings to an experiment that can be loaded."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.location import sha256_of
from identification.experiment.toml_file import FILE_NAME
from identification.recipes import RAW_READERS
from identification.recipes.base import Recipe
from vibrojax.errors import InputError


@contextmanager
def recipe_experiment(recipe: Recipe, data: Path) -> Iterator[Path]:
    """Lend an experiment folder made from the recordings; it is gone when the block ends.

    Args:
        recipe: as loaded.
        data: folder of the data set, or the folder above it.

    Yields:
        A folder with `experiment.toml` and one file per record.

    Raises:
        InputError: a raw file is missing, cannot be read, or is another than the recipe was written for.
    """
    source = find_recordings(recipe, data)
    with tempfile.TemporaryDirectory(prefix=f"{recipe.name}-") as name:
        folder = Path(name)
        shutil.copyfile(recipe.folder / FILE_NAME, folder / FILE_NAME)
        for cut in recipe.cuts:
            columns: dict[str, Any] = dict(RAW_READERS[recipe.reader](source, cut))
            np.savez(folder / cut.file, **columns)
        yield folder


def find_recordings(recipe: Recipe, data: Path) -> Path:
    """Folder that holds the recipe's raw files, each checked by its digest; errors as for `recipe_experiment`."""
    below = data / recipe.data_folder
    folder = below if below.is_dir() else data
    missing = [path for path in recipe.sha256 if not (folder / path).is_file()]
    if missing:
        what = f"{len(missing)} of {len(recipe.sha256)} files of recipe {recipe.name!r}, the first {missing[0]!r}"
        raise InputError(f"{folder} lacks {what}: get the recordings from {recipe.origin} and name their folder with --data")
    for path, wanted in recipe.sha256.items():
        try:
            found = sha256_of(folder / path)
        except OSError as error:
            raise InputError(f"{folder / path} cannot be read: {error.strerror or error}; check its rights") from error
        if found != wanted:
            raise InputError(
                f"{folder / path} is not the file that recipe {recipe.name!r} was written for "
                f"(sha256 {found[:12]}…, expected {wanted[:12]}…): get it again from {recipe.origin}"
            )
    return folder
