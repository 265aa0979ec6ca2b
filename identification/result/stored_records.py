"""Records with their predictions as variables of a file, and back, with every number unchanged."""

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

from identification.experiment import Experiment, Record, si_unit
from identification.result.netcdf_file import Series, floats, variable
from identification.result.plain_dataclass import from_plain, to_plain
from identification.result.result import RecordFit

MOTION = {
    "relative_displacement": ("m", "u of the fitted motion, hammer minus cart"),
    "relative_velocity": ("m/s", "velocity of u in the fitted motion"),
    "in_contact": ("1", "whether hammer and stop touch in the fitted motion"),
    "window": ("1", "number of the window that the sample was fitted in"),
}
SERIES = ("time", "measured", "predicted", *MOTION)


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredRecords:
    """Stored records: their series by name, and one document per record with all other content."""

    variables: dict[str, xr.Variable]
    documents: list[dict[str, Any]]


def store_records(records: tuple[RecordFit, ...], prefix: str) -> StoredRecords:
    """Records as variables `prefix1_...`, `prefix2_...`, SI, with units and descriptions."""
    variables: dict[str, xr.Variable] = {}
    for number, record in enumerate(records, start=1):
        variables |= _series(record, f"{prefix}{number}")
    return StoredRecords(variables=variables, documents=[_document(record) for record in records])


def restore_records(documents: list[dict[str, Any]], series: Series, prefix: str) -> tuple[RecordFit, ...]:
    """Restore records from documents and series."""
    return tuple(_record(each, series, f"{prefix}{number}") for number, each in enumerate(documents, start=1))


def store_experiment(experiment: Experiment) -> dict[str, Any]:
    """The experiment without the series of its records, as plain data."""
    return to_plain(experiment, without=("time", "channels"))


def restore_experiment(document: dict[str, Any], records: tuple[RecordFit, ...]) -> Experiment:
    """The experiment with the series of its fitted records."""
    by_file = {record.file: record for record in records}
    read = [(each, by_file[each["file"]]) for each in document["records"]]
    return from_plain(
        Experiment,
        {name: value for name, value in document.items() if name != "records"},
        records=tuple(from_plain(Record, each, time=record.time, channels=record.measured) for each, record in read),
    )


def _series(record: RecordFit, prefix: str) -> dict[str, xr.Variable]:
    """Measured, predicted and residual series of one record as variables."""
    dimension = f"{prefix}_time"

    def series_of(values: np.ndarray, units: str, long_name: str) -> xr.Variable:
        return variable(dimension, values, units, long_name, record=record.file)

    found = {dimension: series_of(record.time, "s", "time")}
    for what, channels in {"measured": record.measured, "model": record.predicted}.items():
        found |= {f"{prefix}_{what}_{name}": series_of(values, si_unit(name), f"{name}, {what}") for name, values in channels.items()}
    for name in record.measured:
        residual = (record.measured[name] - record.predicted[name]) / record.noise[name]
        found[f"{prefix}_residual_{name}"] = series_of(residual, "1", f"{name}, measured less model over the noise")
    return found | {f"{prefix}_{name}": series_of(getattr(record, name), *words) for name, words in MOTION.items()}


def _document(record: RecordFit) -> dict[str, Any]:
    """Content of a record other than series, and the order of its channels."""
    return to_plain(record, without=SERIES) | {"channels": {"measured": list(record.measured), "predicted": list(record.predicted)}}


def _record(document: dict[str, Any], series: Series, prefix: str) -> RecordFit:
    """One record restored with its series."""
    plain_part = {name: value for name, value in document.items() if name != "channels"}
    return from_plain(
        RecordFit,
        plain_part,
        time=floats(series[f"{prefix}_time"]),
        measured={name: floats(series[f"{prefix}_measured_{name}"]) for name in document["channels"]["measured"]},
        predicted={name: floats(series[f"{prefix}_model_{name}"]) for name in document["channels"]["predicted"]},
        relative_displacement=floats(series[f"{prefix}_relative_displacement"]),
        relative_velocity=floats(series[f"{prefix}_relative_velocity"]),
        in_contact=series[f"{prefix}_in_contact"] != 0,
        window=series[f"{prefix}_window"].astype(np.int64),
    )
