"""Where the data that come with the project are: the embedded example and the tables of reference values."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_path(*parts: str) -> Path:
    """Path of a file or folder below the project's `data/`, in a repository and in an installed wheel alike.

    A wheel carries `data/` as `vibrojax/_data`; a repository keeps it beside the package, and that one wins.

    Args:
        *parts: path components below `data/`; none gives the folder itself.

    Returns:
        The path, which exists.

    Raises:
        FileNotFoundError: no such file or folder comes with the project.

    Example:
        >>> from vibrojax.data_files import data_path
        >>> data_path().is_dir()
        True
    """
    in_repository = (_PACKAGE.parent / "pyproject.toml").is_file()
    root = _PACKAGE.parent / "data" if in_repository else _PACKAGE / "_data"
    path = root.joinpath(*parts)
    if not path.exists():
        raise FileNotFoundError(f"no {'/'.join(parts) or 'data'!r} in the project's data folder {root}")
    return path
