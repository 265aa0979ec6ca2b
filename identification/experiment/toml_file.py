"""The experiment file: found, parsed, and read table by table with messages that say what to do."""

import hashlib
import math
import os
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from identification.experiment.channels import SI_UNITS, factor_to_si
from identification.experiment.errors import ExperimentError, check_printable, listed, shown, suggestion
from identification.experiment.limits import MAX_BYTES, parse_limited

FILE_NAME = "experiment.toml"


def find_experiment_file(path: Path) -> Path:
    """The experiment file that a path means: `experiment.toml` of a folder, or a `.toml` file itself; refused where there is none."""
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


def experiments_below(folder: Path) -> dict[str, Path]:
    """Folders of all experiments in a folder and below it, by their path from there, such as "monday/drop-3", in alphabetical order.

    Hidden folders, and links to folders, are not searched.

    Raises:
        ExperimentError: there is no such folder, it holds no experiment, or the path of one is not printable.
    """
    if not folder.is_dir():
        what = "is no folder" if folder.exists() else "does not exist"
        raise ExperimentError(f"{folder} {what}: expected a folder with experiments below it; check the path")
    found = {}
    for where, names, files in os.walk(folder):
        names[:] = [name for name in names if not name.startswith(".")]
        if FILE_NAME in files:
            path = Path(where)
            found[check_printable(path.relative_to(folder).as_posix(), "the folder of an experiment")] = path
    if not found:
        raise ExperimentError(f"there is no {FILE_NAME} in {folder} or below it: expected a folder for each experiment; check the path")
    return dict(sorted(found.items()))


def parse_toml(file: Path) -> tuple[dict[str, object], str]:
    """Read and parse an experiment file.

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
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ExperimentError(f"{file.name} is not UTF-8 text (line {line}): expected UTF-8; save it in that encoding") from error
    try:
        return parse_limited(text), hashlib.sha256(content).hexdigest()
    except ValueError as error:
        place = "" if "line " in str(error) else f" (line {len(text.splitlines())} is the last)"
        raise ExperimentError(f"{file.name} is not valid TOML: {error}{place}; correct it there") from error


QUANTITY = re.compile(r"(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>[^\d\s.+-]\S*)")


@dataclass(frozen=True, kw_only=True)
class Table:
    """One TOML table and the words that place it.

    Attributes:
        values: the table as parsed.
        where: how a message names it, for instance "[hammer]" or "record 'cart1.csv'".
    """

    values: dict[str, object]
    where: str

    def allow(self, *known: str, noun: str = "key") -> None:
        """Refuse every key that is not `known`, with the nearest known one as a hint; `noun` is what a key is called here."""
        for key in self.values:
            if key not in known:
                raise ExperimentError(f"unknown {noun} {shown(key)} in {self.where}{suggestion(key, known)}")

    def number(self, key: str, *, unit: str = "", positive: bool = False) -> float | None:
        """Read an optional number, finite and, where `positive`, above 0; None where the key is absent. `unit` is for the message."""
        if key not in self.values:
            return None
        return finite(self.values[key], f"{key} in {self.where}", unit=unit, positive=positive)

    def needed_number(self, key: str, *, unit: str, positive: bool = False) -> float:
        """Read a number that must be there; arguments and errors as for `number`."""
        value = self.number(key, unit=unit, positive=positive)
        if value is None:
            raise ExperimentError(f"{key} is missing in {self.where}: expected {_wanted(unit, positive)}; add a line '{key} = …'")
        return value

    def quantity(self, key: str, dimension: str, *, example: str, bare: bool = True, positive: bool = False) -> float | None:
        """Read an optional number with its unit, such as "5 deg", as SI: finite and, where `positive`, above 0; None where it is absent.

        `dimension` is as for `factor_to_si`, `example` a value as it should be written, for the message. A number without a unit is in SI,
        or refused where it may not stand `bare`.
        """
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, str) and (found := QUANTITY.fullmatch(value.strip())):
            where = f"{key} of {self.where}"
            return finite(float(found["number"]), where, positive=positive) * factor_to_si(found["unit"], dimension, where)
        if isinstance(value, str) or not bare:
            raise ExperimentError(f'{key} in {self.where} is {shown(value)}: expected a number with its unit; write {key} = "{example}"')
        return finite(value, f"{key} in {self.where}", unit=SI_UNITS[dimension], positive=positive)

    def string(self, key: str, choices: Collection[str] | None = None) -> str | None:
        """Read an optional, non-empty string, one of `choices` where these are given; None where the key is absent."""
        if key not in self.values:
            return None
        value = self.values[key]
        if not isinstance(value, str) or not value.strip():
            raise ExperimentError(f"{key} in {self.where} is {shown(value)}: expected a text in quotes; correct it")
        if choices is not None and value not in choices:
            raise ExperimentError(f"unknown {key} {shown(value)} in {self.where}{suggestion(value, choices)}")
        return value

    def needed_string(self, key: str, choices: Collection[str] | None = None) -> str:
        """Read a string that must be there; arguments and errors as for `string`."""
        value = self.string(key, choices)
        if value is None:
            wanted = "a text in quotes" if choices is None else f"one of {listed(choices)}"
            raise ExperimentError(f"{key} is missing in {self.where}: expected {wanted}; add a line '{key} = \"…\"'")
        return value

    def whole(self, key: str, least: int, most: int | None = None) -> int | None:
        """Read an optional whole number between limits; None where the key is absent."""
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int) or value < least or (most is not None and value > most):
            wanted = f"from {least} on" if most is None else f"from {least} to {most}"
            raise ExperimentError(f"{key} in {self.where} is {shown(value)}: expected a whole number {wanted}; correct it")
        return value

    def interval(self, key: str, unit: str, written: str = "[lower, higher]") -> tuple[float, float] | None:
        """Read an optional list of two rising numbers; None where the key is absent. `unit` is "in N", or words in its place."""
        if key not in self.values:
            return None
        value, given = self.values[key], f"{key} in {self.where}"
        if not isinstance(value, list) or len(value) != 2:
            raise ExperimentError(f"{given} is {shown(value)}: expected two numbers {unit}; write {key} = {written}")
        low, high = (finite(each, given, unit=unit.removeprefix("in ")) for each in value)
        if low >= high:
            raise ExperimentError(f"{given} is {shown(value)}: expected the lower number first; write {key} = {written}")
        return low, high

    def flag(self, key: str) -> bool:
        """Read an optional true or false (absent: False)."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise ExperimentError(f"{key} in {self.where} is {shown(value)}: expected true or false, without quotes; correct it")
        return value

    def strings(self, key: str, known: Iterable[str], choices: Collection[str] | None = None) -> dict[str, str]:
        """Read an optional table of strings, by names of `known` channels (absent: empty); `choices` as for `string`."""
        table = self.table(key, f"{key} of {self.where}")
        table.allow(*known, noun="channel")
        return {channel: table.needed_string(channel, choices) for channel in table.values}

    def table(self, key: str, where: str) -> "Table":
        """Enter a table below this one (absent: empty); `where` is how messages name it."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise ExperimentError(f"{where} is {shown(value)}: expected a table; write a line '{where}' and its keys below")
        return Table(values=value, where=where)


def finite(value: object, what: str, *, unit: str = "", positive: bool = False) -> float:
    """Check that a parsed value is a finite number, above 0 where `positive`; neither true nor "1" is one. `what` and `unit` name it.

    Example:
        >>> finite(2, "mass", positive=True)
        2.0
    """
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
        number = float(value)
    if not math.isfinite(number) or (positive and number <= 0.0):
        remedy = "write the bare number" if isinstance(value, str | bool) else "correct it"
        raise ExperimentError(f"{what} is {shown(value)}: expected {_wanted(unit, positive)}; {remedy}")
    return number


def _wanted(unit: str, positive: bool) -> str:
    """Describe the number that would have been right."""
    return "a finite number" + (" above 0" if positive else "") + (f" in {unit}" if unit else "")
