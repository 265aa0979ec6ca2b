"""Where a record's file lies: inside the experiment's folder, nowhere else."""

import hashlib
from pathlib import Path, PurePosixPath, PureWindowsPath

from identification.experiment.errors import ExperimentError, check_printable, shown


def record_path(folder: Path, file: str) -> Path:
    """Resolve a record's path and check that it stays inside the folder.

    Args:
        folder: the experiment's folder.
        file: relative path as written in the experiment file.

    Returns:
        The path; the file need not exist.

    Raises:
        ExperimentError: the path is absolute, climbs out with "..", holds control characters, or a link leads out of the folder.
    """
    remedy = "expected a path inside the experiment's folder; put the file there"
    windows = PureWindowsPath(file)
    if PurePosixPath(file).is_absolute() or windows.drive or windows.root or ".." in windows.parts:
        raise ExperimentError(f"record {shown(file)} lies outside the experiment's folder: {remedy}")
    try:
        path = (folder / file).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise ExperimentError(f"record {shown(file)} is not a usable path ({error}): {remedy}") from error
    check_printable(file, "the path of a record")
    if not path.is_relative_to(folder.resolve()):
        raise ExperimentError(f"record {shown(file)} leads out of the experiment's folder through a link: {remedy}")
    return path


def file_exists(path: Path, file: str) -> bool:
    """Say whether a record's file is there.

    Args:
        path: from `record_path`.
        file: as written, for the message.

    Returns:
        False where nothing bears that name.

    Raises:
        ExperimentError: something bears it that is not a plain file.
    """
    try:
        if path.is_file():
            return True
        there = path.exists()
    except OSError as error:
        raise ExperimentError(f"record {shown(file)} cannot be opened ({error.strerror or error}): check its name and rights") from error
    if there:
        raise ExperimentError(f"record {shown(file)} is not a file: expected a file with recorded data; check its name")
    return False


def sha256_of(path: Path) -> str:
    """Digest a file's bytes.

    Args:
        path: the file.

    Returns:
        sha256 in hexadecimal.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
