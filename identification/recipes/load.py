"""Recipes by name."""

from pathlib import Path

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.settings.schema import Table
from identification.experiment.settings.toml_file import parse_toml
from identification.recipes.base import Cut, Recipe
from vibrojax.data_files import data_path
from vibrojax.errors import InputError

SCHEMA = 1
FILE_NAME = "recipe.toml"
TEXTS = ("title", "origin", "licence", "citation", "obtain", "expect", "reader", "data_folder")


def recipe_names() -> tuple[str, ...]:
    """Names of all recipes that come with the project, sorted."""
    return tuple(sorted(file.parent.name for file in data_path("recipes").glob(f"*/{FILE_NAME}")))


def load_recipe(name: str) -> Recipe:
    """Read a recipe.

    Args:
        name: of its folder below `data/recipes`.

    Returns:
        The recipe.

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
    folder = data_path("recipes", name)
    return read_recipe(folder)


def read_recipe(folder: Path) -> Recipe:
    """Read the recipe of a folder; errors as for `load_recipe`."""
    values, _ = parse_toml(folder / FILE_NAME)
    table = Table(values=values, where=f"{folder.name}/{FILE_NAME}")
    table.allow("schema", *TEXTS, "file", "record")
    if table.needed_number("schema", unit="") != SCHEMA:
        raise ExperimentError(f"schema in {table.where} is {shown(values['schema'])}: expected {SCHEMA}")
    files = [Table(values=each, where=f"a file of {table.where}") for each in _tables(table, "file")]
    return Recipe(
        name=folder.name,
        folder=folder,
        **{key: table.needed_string(key) for key in TEXTS},
        sha256={each.needed_string("path"): each.needed_string("sha256") for each in files},
        cuts=tuple(_cut(Table(values=each, where=f"a record of {table.where}")) for each in _tables(table, "record")),
    )


def _tables(table: Table, key: str) -> list[dict[str, object]]:
    """An array of tables that must not be empty."""
    found = table.values.get(key)
    if not isinstance(found, list) or not found or not all(isinstance(each, dict) for each in found):
        raise ExperimentError(f"{table.where} has no table [[{key}]]: expected at least one; add it")
    return found


def _cut(table: Table) -> Cut:
    named = ("file", "source", "start", "stop")
    return Cut(
        file=table.needed_string("file"),
        source=table.needed_string("source"),
        start=table.needed_number("start", unit="s"),
        stop=table.needed_number("stop", unit="s"),
        options={key: value for key, value in table.values.items() if key not in named},
    )
