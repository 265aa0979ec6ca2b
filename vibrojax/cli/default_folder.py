"""Where results go when the command line does not say."""

import re
from pathlib import Path

from vibrojax.data_files import data_path

_LONGEST = 50
"""Characters of an experiment's name in a folder's name, which the system limits to 255 bytes."""


def default_folder(job: str, experiment: Path | None, recipe: str | None) -> Path:
    """`JOB-NAME` here, NAME being the experiment's.

    An experiment file that cannot be read gets a name all the same, since reading it properly comes later.

    Args:
        job: what the command does, such as "diagnose".
        experiment: the argument; None for a recipe or the embedded example.
        recipe: `--recipe`.

    Example:
        >>> print(default_folder("diagnose", None, "silverbox"))
        diagnose-silverbox
    """
    from identification.experiment.limits import MAX_BYTES, parse_limited

    if recipe is not None:
        return Path(f"{job}-{_plain(recipe) or 'recipe'}")
    experiment = data_path("example") if experiment is None else experiment
    file = experiment / "experiment.toml" if experiment.is_dir() else experiment
    try:
        with file.open("rb") as stream:
            name = str(parse_limited(stream.read(MAX_BYTES).decode("utf-8-sig"))["experiment"]["name"])
    except (OSError, ValueError, KeyError, TypeError):
        name = file.absolute().parent.name
    return Path(f"{job}-{_plain(name) or 'experiment'}")


def _plain(name: str) -> str:
    """A name as part of a folder's name."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-.")[:_LONGEST].strip("-.")
