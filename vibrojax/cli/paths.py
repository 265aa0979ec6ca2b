"""Paths on the command line, checked before anything slow is imported."""

from pathlib import Path

from vibrojax.errors import InputError


def check_file(path: Path, expected: str) -> None:
    """Refuse a path where there is no file.

    Args:
        path: as given.
        expected: what the file should be, with its article.

    Raises:
        InputError: there is none.

    Example:
        >>> check_file(Path("nowhere.json"), "the model.json of a fit")
        Traceback (most recent call last):
        vibrojax.errors.InputError: nowhere.json cannot be read (no such file): expected the model.json of a fit; check the path
    """
    if not path.is_file():
        reason = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path} cannot be read ({reason}): expected {expected}; check the path")


def check_experiment(path: Path) -> None:
    """Refuse a path where there is no experiment.

    Args:
        path: of its folder or file, as given.

    Raises:
        ExperimentError: there is none.
    """
    from identification.experiment.toml_file import find_experiment_file

    find_experiment_file(path)
