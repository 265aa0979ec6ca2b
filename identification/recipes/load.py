"""Recipes by name, their recordings checked by digest, and the experiment that is made of them.

A recipe is a folder `data/recipes/NAME` with an `experiment.toml` as any experiment has and a `recipe.toml` that says where the recordings
come from and which part of which raw file becomes which record. The recordings themselves never come with the project.
"""

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.limits import sha256_of
from identification.experiment.toml_file import FILE_NAME, Table, parse_toml
from identification.recipes.layouts import RAW_READERS, Cut
from vibrojax.data_files import data_path
from vibrojax.errors import InputError

SCHEMA = 1
RECIPE_FILE = "recipe.toml"
TEXTS = ("title", "origin", "licence", "citation", "obtain", "expect", "reader", "data_folder")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A checked `recipe.toml`.

    Attributes:
        name: of the recipe.
        folder: with `recipe.toml` and `experiment.toml`.
        title: one line on the rig.
        origin: address of the recordings.
        licence: of the recordings.
        citation: of whoever made them.
        obtain: how to come by the files, in a sentence or two.
        expect: what the nominal model explains and what it does not, in a sentence.
        reader: name of the raw reader.
        data_folder: usual name of the data set's folder.
        sha256: digest of every raw file that is needed, by its path in the data set's folder.
        cuts: the records.
    """

    name: str
    folder: Path
    title: str
    origin: str
    licence: str
    citation: str
    obtain: str
    expect: str
    reader: str
    data_folder: str
    sha256: Mapping[str, str]
    cuts: tuple[Cut, ...]


def recipe_names() -> tuple[str, ...]:
    """Names of all recipes that come with the project, sorted."""
    return tuple(sorted(file.parent.name for file in data_path("recipes").glob(f"*/{RECIPE_FILE}")))


def load_recipe(name: str) -> Recipe:
    """Read the recipe of a name, that of its folder below `data/recipes`.

    Raises:
        InputError: there is none of that name; the message lists those there are.
        ExperimentError: its `recipe.toml` is not of this format.

    Example:
        >>> load_recipe("airtrack_rubber").licence
        'MIT'
    """
    names = recipe_names()
    if name not in names:
        raise InputError(f"unknown recipe {shown(name)}: expected one of {listed(names)}")
    return read_recipe(data_path("recipes", name))


def read_recipe(folder: Path) -> Recipe:
    """Read the recipe of a folder; errors as for `load_recipe`."""
    values, _ = parse_toml(folder / RECIPE_FILE)
    table = Table(values=values, where=f"{folder.name}/{RECIPE_FILE}")
    table.allow("schema", *TEXTS, "file", "record")
    if table.needed_number("schema", unit="") != SCHEMA:
        raise ExperimentError(f"schema in {table.where} is {shown(values['schema'])}: expected {SCHEMA}")
    return Recipe(
        name=folder.name,
        folder=folder,
        **{key: table.needed_string(key) for key in TEXTS},
        sha256={each.needed_string("path"): each.needed_string("sha256") for each in _tables(table, "file")},
        cuts=tuple(map(_cut, _tables(table, "record"))),
    )


def _tables(table: Table, key: str) -> list[Table]:
    """An array of tables that must not be empty."""
    found = table.values.get(key)
    if not isinstance(found, list) or not found or not all(isinstance(each, dict) for each in found):
        raise ExperimentError(f"{table.where} has no table [[{key}]]: expected at least one; add it")
    return [Table(values=each, where=f"a {key} of {table.where}") for each in found]


def _cut(table: Table) -> Cut:
    named = ("file", "source", "start", "stop")
    return Cut(
        file=table.needed_string("file"),
        source=table.needed_string("source"),
        start=table.needed_number("start", unit="s"),
        stop=table.needed_number("stop", unit="s"),
        options={key: value for key, value in table.values.items() if key not in named},
    )


PRESENT, MISSING, DIFFERS = "present", "missing", "differs"


def recordings_folder(recipe: Recipe, data: Path) -> Path:
    """Folder that should hold the recipe's raw files: its usual folder below `data` if there is one, else `data` itself."""
    below = data / recipe.data_folder
    return below if below.is_dir() else data


def recording_states(recipe: Recipe, data: Path) -> dict[str, str]:
    """Whether every raw file of a recipe is `PRESENT`, `MISSING`, or there with other content, `DIFFERS`; by path in the data set."""
    folder = recordings_folder(recipe, data)
    return {path: _state(folder / path, wanted) for path, wanted in recipe.sha256.items()}


def find_recordings(recipe: Recipe, data: Path) -> Path:
    """Folder that holds the recipe's raw files, each checked by its digest; `data` is the folder of the data set, or the one above it.

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
        digest, wanted = sha256_of(folder / other)[:12], recipe.sha256[other][:12]
        raise InputError(
            f"{folder / other} is not the file that recipe {recipe.name!r} was written for "
            f"(sha256 {digest}…, expected {wanted}…): get it again from {recipe.origin}"
        )
    return folder


def _state(file: Path, wanted: str) -> str:
    if not file.is_file():
        return MISSING
    try:
        return PRESENT if sha256_of(file) == wanted else DIFFERS
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}; check its rights") from error


@contextmanager
def recipe_experiment(recipe: Recipe, data: Path) -> Iterator[Path]:
    """Lend an experiment folder made from the recordings, `experiment.toml` and one file per record; it is gone when the block ends.

    Arguments and errors as for `find_recordings`.
    """
    source = find_recordings(recipe, data)
    with tempfile.TemporaryDirectory(prefix=f"{recipe.name}-") as name:
        folder = Path(name)
        shutil.copyfile(recipe.folder / FILE_NAME, folder / FILE_NAME)
        for cut in recipe.cuts:
            columns: dict[str, Any] = dict(RAW_READERS[recipe.reader](source, cut))
            np.savez(folder / cut.file, **columns)
        yield folder
