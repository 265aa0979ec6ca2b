"""From a recipe and a folder of recordings to an experiment that can be loaded."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.settings.toml_file import FILE_NAME
from identification.recipes import RAW_READERS
from identification.recipes.base import Recipe
from identification.recipes.recordings import find_recordings


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
