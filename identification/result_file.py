"""`result.nc`: everything a fit found, in one NetCDF file; other programs read its series, this one draws its page again from it.

The series of every record lie in variables `record1_...`, SI, with units and descriptions. What is no series stands in the attribute `fit`,
as JSON. Nothing is pickled.
"""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from identification.experiment import Experiment, Record, si_unit
from identification.plain_dataclass import from_plain, to_plain
from identification.reference import Reference
from identification.result import Derived, FitResult, ParameterEstimate, RecordFit, StartOutcome
from identification.result_json import plain
from vibrojax.errors import InputError
from vibrojax.model_file import model_document, model_from_document

FILE_NAME = "result.nc"
SCHEMA = 1
MOTION = {
    "relative_displacement": ("m", "u of the fitted motion, hammer minus cart"),
    "relative_velocity": ("m/s", "velocity of u in the fitted motion"),
    "in_contact": ("1", "whether hammer and stop touch in the fitted motion"),
    "window": ("1", "number of the window that the sample was fitted in"),
}
SERIES = ("time", "measured", "predicted", *MOTION)
PARTS = {"parameters": tuple[ParameterEstimate, ...], "derived": tuple[Derived, ...], "starts": tuple[StartOutcome, ...]}
NUMBERS = ("correlated", "chi2_reduced", "degrees", "converged", "iterations", "discretisation", "warnings", "seed", "seconds")


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredFit:
    """What the page of a fit is drawn from.

    Attributes:
        result: of the fit.
        reference: known values that were set beside it, or None.
        provenance: as in `fit.json`.
    """

    result: FitResult
    reference: Reference | None
    provenance: Mapping[str, Any]


def write_result(stored: StoredFit, path: Path) -> None:
    """Write a fit.

    Args:
        stored: the fit and what its page shows beside it.
        path: of the file; replaced if it exists.
    """
    result = stored.result
    variables: dict[str, xr.Variable] = {}
    for number, record in enumerate((*result.records, *result.held_back), start=1):
        variables |= _series(record, f"record{number}")
    document = {
        "schema": SCHEMA,
        "experiment": to_plain(result.experiment, without=("time", "channels")),
        "model": model_document(result.model),
        "correlation": plain(result.correlation),
        "records": [_document(record) for record in result.records],
        "held_back": [_document(record) for record in result.held_back],
        **{name: to_plain(getattr(result, name)) for name in (*PARTS, *NUMBERS)},
        "reference": to_plain(stored.reference),
        "provenance": plain(stored.provenance),
    }
    attributes = {"title": f"{result.experiment.name}: fitted impact model", "fit": json.dumps(document, allow_nan=False)}
    xr.Dataset(variables, attrs=attributes).to_netcdf(path, engine="scipy")


def read_result(path: Path) -> StoredFit:
    """Read a fit.

    Args:
        path: of a file that `write_result` wrote.

    Returns:
        The same fit: every number as it was.

    Raises:
        InputError: the file is not there, damaged, or of another version.
    """
    if not path.is_file():
        raise InputError(f"{path} does not exist: expected the {FILE_NAME} that a fit writes beside fit.json; fit again")
    try:
        with xr.open_dataset(path, engine="scipy", decode_cf=False) as data:
            document = json.loads(data.attrs["fit"])
            series = {str(name): np.array(variable.values) for name, variable in data.variables.items()}
        if document["schema"] != SCHEMA:
            raise InputError(f"{path} is of schema {document['schema']}: expected {SCHEMA}; fit again with this version")
        return _stored(document, series, str(path))
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file leads to
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{path} cannot be read as a result of a fit ({reason}): fit again") from error


def _series(record: RecordFit, prefix: str) -> dict[str, xr.Variable]:
    """The series of one record."""
    dimension = f"{prefix}_time"

    def variable(values: np.ndarray, units: str, long_name: str) -> xr.Variable:
        stored = values.astype(np.int8) if values.dtype == bool else values.astype(np.int32) if values.dtype.kind == "i" else values
        return xr.Variable(dimension, stored, {"units": units, "long_name": long_name, "record": record.file}, {"_FillValue": None})

    found = {dimension: variable(record.time, "s", "time")}
    for what, channels in {"measured": record.measured, "model": record.predicted}.items():
        found |= {f"{prefix}_{what}_{name}": variable(values, si_unit(name), f"{name}, {what}") for name, values in channels.items()}
    for name in record.measured:
        residual = (record.measured[name] - record.predicted[name]) / record.noise[name]
        found[f"{prefix}_residual_{name}"] = variable(residual, "1", f"{name}, measured less model over the noise")
    return found | {f"{prefix}_{name}": variable(getattr(record, name), *told) for name, told in MOTION.items()}


def _document(record: RecordFit) -> dict[str, Any]:
    """What of a record is no series, and the order of its channels."""
    return to_plain(record, without=SERIES) | {"channels": {"measured": list(record.measured), "predicted": list(record.predicted)}}


def _stored(document: dict[str, Any], series: dict[str, np.ndarray], where: str) -> StoredFit:
    """Put everything together again."""
    told = [*document["records"], *document["held_back"]]
    records = [_record(each, series, f"record{number}") for number, each in enumerate(told, start=1)]
    by_file = {record.file: record for record in records}
    read = [(each, by_file[each["file"]]) for each in document["experiment"]["records"]]
    experiment = from_plain(
        Experiment,
        {name: value for name, value in document["experiment"].items() if name != "records"},
        records=tuple(from_plain(Record, each, time=record.time, channels=record.measured) for each, record in read),
    )
    fields = {field.name: field.type for field in dataclasses.fields(FitResult)}
    count = len(document["correlated"])
    correlation = [np.nan if each is None else each for row in document["correlation"] for each in row]
    result = FitResult(
        experiment=experiment,
        model=model_from_document(document["model"], where),
        correlation=np.array(correlation, dtype=np.float64).reshape(count, count),
        records=tuple(records[: len(document["records"])]),
        held_back=tuple(records[len(document["records"]) :]),
        **{name: from_plain(kind, document[name]) for name, kind in PARTS.items()},
        **{name: from_plain(fields[name], document[name]) for name in NUMBERS},
    )
    return StoredFit(result=result, reference=from_plain(Reference | None, document["reference"]), provenance=document["provenance"])


def _record(told: dict[str, Any], series: dict[str, np.ndarray], prefix: str) -> RecordFit:
    """One record with its series."""
    plain_part = {name: value for name, value in told.items() if name != "channels"}
    return from_plain(
        RecordFit,
        plain_part,
        time=_floats(series[f"{prefix}_time"]),
        measured={name: _floats(series[f"{prefix}_measured_{name}"]) for name in told["channels"]["measured"]},
        predicted={name: _floats(series[f"{prefix}_model_{name}"]) for name in told["channels"]["predicted"]},
        relative_displacement=_floats(series[f"{prefix}_relative_displacement"]),
        relative_velocity=_floats(series[f"{prefix}_relative_velocity"]),
        in_contact=series[f"{prefix}_in_contact"] != 0,
        window=series[f"{prefix}_window"].astype(np.int64),
    )


def _floats(values: np.ndarray) -> np.ndarray:
    """In the machine's own byte order; NetCDF has its own."""
    return values.astype(np.float64)
