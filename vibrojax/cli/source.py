"""Which experiment a command works on: a folder, a recipe and its recordings, or the embedded example."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibrojax.cli.interrupt import removed_at_end
from vibrojax.cli.paths import check_experiment
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


def check_source(experiment: Path | None, recipe: str | None, data: Path | None) -> None:
    """Refuse a command line that names two experiments, half of one, or one that is not there; quick, since JAX is not imported for it.

    Args:
        experiment: the argument.
        recipe: `--recipe`.
        data: `--data`.

    Raises:
        InputError: EXPERIMENT beside `--recipe`, or one of `--recipe` and `--data` without the other.
        ExperimentError: there is no experiment at EXPERIMENT.

    Example:
        >>> check_source(None, "silverbox", None)
        Traceback (most recent call last):
        vibrojax.errors.InputError: --recipe silverbox needs the folder of its recordings: add --data DIR
    """
    if recipe is not None and experiment is not None:
        raise InputError(f"both {experiment} and --recipe {recipe} are given: expected one experiment; leave one out")
    if recipe is not None and data is None:
        raise InputError(f"--recipe {recipe} needs the folder of its recordings: add --data DIR")
    if data is not None and recipe is None:
        raise InputError(f"--data {data} is given without --recipe NAME: expected both or neither; add the recipe's name")
    if experiment is not None:
        check_experiment(experiment)


@contextmanager
def experiment_source(experiment: Path | None, recipe: str | None, data: Path | None) -> Iterator[Path]:
    """Lend the folder (or file) of the experiment that the command line names.

    Args:
        experiment: the argument; None for a recipe or the embedded example.
        recipe: `--recipe`.
        data: `--data`.

    Yields:
        What `load_experiment` reads; a recipe's folder is gone when the block ends.

    Raises:
        InputError: as for `check_source`; an unknown recipe; recordings that are missing or other than expected.
        ExperimentError: as for `check_source`.
    """
    check_source(experiment, recipe, data)
    if recipe is None or data is None:
        yield data_path("example") if experiment is None else experiment
        return
    from identification.recipes.load import load_recipe, recipe_experiment

    with recipe_experiment(load_recipe(recipe), data) as folder, removed_at_end([folder]):
        yield folder
