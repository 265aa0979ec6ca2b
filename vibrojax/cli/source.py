"""What the command line names: an experiment, a recipe and its recordings, or the embedded example; files; and where results go."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from vibrojax.aside import of_earlier_set
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.interrupt import removed_at_end
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import Stages, stages
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


def check_source(experiment: Path | None, recipe: str | None, data: Path | None) -> None:
    """Refuse a command line that names two experiments, half of one, or one that is not there; quick, since JAX is not imported for it.

    Args:
        experiment: the argument.
        recipe: `--recipe`.
        data: `--data`.

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
    """Lend the folder or file that `check_source` found in order: the experiment, a recipe's for the block alone, or the embedded example.

    Raises:
        InputError: an unknown recipe; recordings that are missing or other than expected.
    """
    if recipe is None or data is None:
        yield data_path("example") if experiment is None else experiment
        return
    from identification.recipes.load import load_recipe, recipe_experiment

    with recipe_experiment(load_recipe(recipe), data) as folder, removed_at_end([folder]):
        yield folder


@contextmanager
def opened(
    job: str, experiment: Path | None, recipe: str | None, data: Path | None, out: Path | None, *, quiet: bool
) -> Iterator[tuple[Path, Path, Stages]]:
    """Lend the experiment, an empty folder for its results, and the stages of the work, with JAX loaded; say at last where results are.

    The folder takes the place of an earlier set of results in `out`, or where that is None in `default_folder`. Errors are those of
    `experiment_source` and `output_folder`.
    """
    out = default_folder(job, experiment, recipe) if out is None else out
    with (
        output_folder(out, outdated=of_earlier_set) as folder,
        experiment_source(experiment, recipe, data) as source,
        stages(quiet=quiet) as say,
    ):
        say("loading JAX")
        prepare_jax()
        yield source, folder, say
    say_results(out, quiet=quiet)


def say_results(out: Path, *, quiet: bool) -> None:
    """Where the results are, and the page to start with."""
    Console(quiet=quiet, highlight=False).print(f"results in {out}; start with {out / 'report.html'}", soft_wrap=True)


_LONGEST = 50
"""Characters of an experiment's name in a folder's name, which the system limits to 255 bytes."""


def default_folder(job: str, experiment: Path | None, recipe: str | None) -> Path:
    """`JOB-NAME` here, NAME being the experiment's, or that of its folder where its file cannot be read: reading it properly comes later.

    Example:
        >>> print(default_folder("diagnose", None, "silverbox"))
        diagnose-silverbox
    """
    from identification.experiment.limits import MAX_BYTES, parse_limited

    if recipe is not None:
        return Path(f"{job}-{plain_name(recipe) or 'recipe'}")
    experiment = data_path("example") if experiment is None else experiment
    file = experiment / "experiment.toml" if experiment.is_dir() else experiment
    try:
        with file.open("rb") as stream:
            name = str(parse_limited(stream.read(MAX_BYTES).decode("utf-8-sig"))["experiment"]["name"])
    except (OSError, ValueError, KeyError, TypeError):
        name = file.absolute().parent.name
    return Path(f"{job}-{plain_name(name) or 'experiment'}")


def plain_name(name: str) -> str:
    """A name as part of a folder's name; empty where no letter of it can be."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-.")[:_LONGEST].strip("-.")


def check_file(path: Path, expected: str) -> None:
    """Refuse a path where there is no file; `expected` says what it should be, with its article.

    Example:
        >>> check_file(Path("nowhere.json"), "the model.json of a fit")
        Traceback (most recent call last):
        vibrojax.errors.InputError: nowhere.json cannot be read (no such file): expected the model.json of a fit; check the path
    """
    if not path.is_file():
        reason = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path} cannot be read ({reason}): expected {expected}; check the path")


def check_experiment(path: Path) -> None:
    """Refuse a path where there is no experiment, an `ExperimentError`."""
    from identification.experiment.toml_file import find_experiment_file

    find_experiment_file(path)
