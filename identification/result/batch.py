"""The state of a batch of fits, `batch.json`: a row an experiment, with a checksum of all that its fit depends on."""

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from identification.experiment import ExperimentError
from identification.experiment.limits import record_path
from identification.experiment.toml_file import FILE_NAME, parse_toml
from identification.result.files import plain
from identification.result.result import OK, FitResult
from vibrojax.aside import of_earlier_set
from vibrojax.errors import InputError, one_line
from vibrojax.json_file import read_json

STATE = "batch.json"
BAD_INPUT, NO_CONVERGENCE = "bad input", "no convergence"
SCHEMA = 1


@dataclasses.dataclass(frozen=True, kw_only=True)
class BatchParameter:
    """Estimate of one parameter: value and standard error in `unit`; None where there is no finite number, or no error."""

    name: str
    symbol: str
    unit: str
    value: float | None
    stderr: float | None
    status: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class BatchRow:
    """What became of one experiment, whose folder has the path `experiment` from that of the batch.

    `digest` is as of `input_digest`, before it was read; `status` the level of the fit's verdict, or `BAD_INPUT` or `NO_CONVERGENCE`, with
    the verdict's `headline`; `seconds` count from reading to the written page; `failure` is the reason, in one line, why there is no fit,
    and what only a fit has is empty then; `fit_sha256` is the checksum of `fit.json`.
    """

    experiment: str
    digest: str
    status: str
    headline: str = ""
    law: str = ""
    parameters: tuple[BatchParameter, ...] = ()
    chi2_reduced: float | None = None
    seconds: float
    failure: str = ""
    fit_sha256: str = ""

    @property
    def fitted(self) -> bool:
        """Whether there is a fit."""
        return not self.failure

    def stands(self, folder: Path) -> bool:
        """Whether the results in `folder` are still those of this row, file for file; where there is no fit, nothing is needed."""
        if not self.fitted:
            return True
        stating = folder / "fit.json"
        if _sha256(stating) != self.fit_sha256:
            return False
        stated = read_json(stating, "the fit.json of a batch")["files"]
        return {Path(name) for name in stated} <= of_earlier_set(folder)


def fitted_row(experiment: str, digest: str, result: FitResult, folder: Path, *, level: str, headline: str, seconds: float) -> BatchRow:
    """Row of an experiment whose results are in `folder`, with level and headline of its verdict."""
    parameters = tuple(
        BatchParameter(
            name=one.spec.name,
            symbol=one.spec.symbol,
            unit=one.spec.unit,
            value=plain(float(one.value)),
            stderr=None if one.status != OK or one.stderr is None else plain(float(one.stderr)),
            status=one.status,
        )
        for one in result.parameters
    )
    return BatchRow(
        experiment=experiment,
        digest=digest,
        status=level,
        headline=headline,
        law=result.model.law.name,
        parameters=parameters,
        chi2_reduced=plain(float(result.chi2_reduced)),
        seconds=seconds,
        fit_sha256=_sha256(folder / "fit.json"),
    )


def failed_row(experiment: str, digest: str, error: Exception, *, seconds: float) -> BatchRow:
    """Row of an experiment that could not be fitted."""
    status = BAD_INPUT if isinstance(error, InputError) else NO_CONVERGENCE
    failure = one_line(str(error)) or type(error).__name__
    return BatchRow(experiment=experiment, digest=digest, status=status, seconds=seconds, failure=failure)


def input_digest(folder: Path, options: Mapping[str, Any]) -> str:
    """SHA-256, in hexadecimal, of an experiment file, of every record that it names, and of the options of the fit, plain data."""
    file = folder / FILE_NAME
    parts = [json.dumps(options, sort_keys=True), _sha256(file)]
    with suppress(ExperimentError):  # which the fit will meet as well
        records = parse_toml(file)[0].get("record")
        for one in records if isinstance(records, list) else []:
            if isinstance(one, dict) and isinstance(name := one.get("file"), str):
                parts += [name, _sha256(record_path(folder, name))]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def options_digest(**options: Any) -> dict[str, Any]:
    """Options of a fit as plain data for `input_digest`: of an earlier fit, or a table of reference values, the checksum of its content."""
    plain_options = {}
    for name, value in options.items():
        if isinstance(value, Path):
            value = _sha256(value / "fit.json" if value.is_dir() else value)
        plain_options[name] = list(value) if isinstance(value, list | tuple) else value
    return plain_options


def read_rows(path: Path) -> dict[str, BatchRow]:
    """Rows of `batch.json` by experiment; none where there is no such file.

    Raises:
        InputError: it is none of a batch.
    """
    if not path.exists():
        return {}
    expected = "the state of a batch; remove it, and every experiment is fitted anew"
    document = read_json(path, expected)
    try:
        if document["schema"] != SCHEMA:
            raise InputError(f"{path} has schema {document['schema']}: expected {SCHEMA}, {expected}")
        rows = [BatchRow(**one | {"parameters": tuple(BatchParameter(**p) for p in one["parameters"])}) for one in document["rows"]]
    except (LookupError, TypeError) as error:
        raise InputError(f"{path} is damaged ({type(error).__name__}): expected {expected}") from error
    return {row.experiment: row for row in rows}


def write_rows(rows: Iterable[BatchRow], path: Path) -> None:
    """Write `batch.json`."""
    document = {"schema": SCHEMA, "rows": [dataclasses.asdict(row) for row in rows]}
    path.write_text(json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def _sha256(path: Path) -> str:
    """Of a file's bytes, in hexadecimal; the reason where it cannot be read."""
    if not path.is_file():
        return "no such file"
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        return str(error.strerror)
