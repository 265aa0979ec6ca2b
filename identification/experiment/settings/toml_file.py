"""The experiment file's text, parsed."""

import hashlib
from pathlib import Path

from identification.experiment.errors import ExperimentError
from identification.experiment.settings.limited_toml import MAX_BYTES, parse_limited

FILE_NAME = "experiment.toml"


def find_experiment_file(path: Path) -> Path:
    """Find the experiment file that a path means.

    Args:
        path: a folder that holds `experiment.toml`, or a `.toml` file itself.

    Returns:
        The file.

    Raises:
        ExperimentError: there is no such file.
    """
    try:
        file = path / FILE_NAME if path.is_dir() else path
        found = file.is_file()
    except (OSError, ValueError) as error:
        raise ExperimentError(f"{path} cannot be opened: {error}; give an experiment's folder or its {FILE_NAME}") from error
    if not found:
        what = f"the folder {path} holds no {FILE_NAME}" if file != path else f"{path} does not exist"
        raise ExperimentError(f"{what}: expected an experiment's folder or its {FILE_NAME}; check the path")
    if file.suffix.lower() != ".toml":
        raise ExperimentError(f"{path} is not a .toml file: expected an experiment's folder or its {FILE_NAME}; check the path")
    return file


def parse_toml(file: Path) -> tuple[dict[str, object], str]:
    """Read and parse an experiment file.

    Args:
        file: the file.

    Returns:
        The top table, and the sha256 of the file's bytes in hexadecimal.

    Raises:
        ExperimentError: it cannot be read, is too large, is not UTF-8, or is not TOML; the message gives the line.
    """
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise ExperimentError(f"{file.name} cannot be read ({error.strerror or error}): expected a text file; check its rights") from error
    if len(content) > MAX_BYTES:
        raise ExperimentError(f"{file.name} is larger than {MAX_BYTES} bytes: expected a short TOML text; put the data into record files")
    text = _decoded(content, file.name)
    try:
        return parse_limited(text), hashlib.sha256(content).hexdigest()
    except ValueError as error:
        place = "" if "line " in str(error) else f" (line {len(text.splitlines())} is the last)"
        raise ExperimentError(f"{file.name} is not valid TOML: {error}{place}; correct it there") from error


def _decoded(content: bytes, name: str) -> str:
    """Decode UTF-8, with or without a byte-order mark; on failure say in which line."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ExperimentError(f"{name} is not UTF-8 text (line {line}): expected UTF-8; save it in that encoding") from error
