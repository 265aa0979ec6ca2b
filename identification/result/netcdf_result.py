"""Fit result as NetCDF: series for other programs, and all content needed to redraw the report page."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from identification.result.json_file import plain
from identification.result.netcdf_file import FIT, Series, dataset, read_netcdf, write_netcdf
from identification.result.plain_dataclass import from_plain, to_plain
from identification.result.posterior.sample import restore_posterior, store_posterior
from identification.result.reference import Reference
from identification.result.result import Derived, FitResult, ParameterEstimate, StartOutcome
from identification.result.stored_records import restore_experiment, restore_records, store_experiment, store_records
from vibrojax.model_file import model_document, model_from_document

PARTS = {"parameters": tuple[ParameterEstimate, ...], "derived": tuple[Derived, ...], "starts": tuple[StartOutcome, ...]}
NUMBERS = (
    "correlated",
    "chi2_reduced",
    "degrees",
    "converged",
    "iterations",
    "discretisation",
    "warnings",
    "unrest",
    "noise",
    "seed",
    "seconds",
    "added",
    "between_records",
    "ring_downs",
    "smoothing",
    "profiles",
    "unfitted",
)
_PREFIX = "record"


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredFit:
    """Content of a fit's report page.

    Attributes:
        result: of the fit.
        reference: known values for comparison, or None.
        provenance: as in `fit.json`.
    """

    result: FitResult
    reference: Reference | None
    provenance: Mapping[str, Any]


def write_result(stored: StoredFit, path: Path) -> None:
    """Write a fit.

    Args:
        stored: the fit and its reference and provenance.
        path: of the file; replaced if it exists.
    """
    write_netcdf(fit_dataset(stored), path)


def fit_dataset(stored: StoredFit) -> xr.Dataset:
    """Dataset of a fit: measured and predicted series of every record over its time, SI; everything else as JSON in one attribute."""
    result = stored.result
    records = store_records((*result.records, *result.held_back), _PREFIX)
    draws, sample = store_posterior(result.posterior)
    document = {
        "experiment": store_experiment(result.experiment),
        "model": model_document(result.model),
        "correlation": plain(result.correlation),
        "records": records.documents[: len(result.records)],
        "held_back": records.documents[len(result.records) :],
        **{name: to_plain(getattr(result, name)) for name in (*PARTS, *NUMBERS)},
        "posterior": sample,
        "reference": to_plain(stored.reference),
        "provenance": plain(stored.provenance),
    }
    title = f"{result.experiment.name}: fitted impact model"
    return dataset(kind=FIT, title=title, variables=records.variables | draws, document=document)


def read_result(path: Path) -> StoredFit:
    """Read a fit.

    Args:
        path: of a file that `write_result` wrote.

    Returns:
        The same fit, with every number unchanged.

    Raises:
        InputError: the file does not exist, is damaged, has another version, or holds no fit.
    """
    return read_netcdf(path, {FIT: stored_fit})


def stored_fit(document: dict[str, Any], series: Series) -> StoredFit:
    """Restore a fit from document and series."""
    records = restore_records([*document["records"], *document["held_back"]], series, _PREFIX)
    fields = {field.name: field.type for field in dataclasses.fields(FitResult)}
    count = len(document["correlated"])
    correlation = [np.nan if each is None else each for row in document["correlation"] for each in row]
    result = FitResult(
        experiment=restore_experiment(document["experiment"], records),
        model=model_from_document(document["model"], "the model in the result"),
        correlation=np.array(correlation, dtype=np.float64).reshape(count, count),
        records=records[: len(document["records"])],
        held_back=records[len(document["records"]) :],
        posterior=restore_posterior(document["posterior"], series),
        **{name: from_plain(kind, document[name]) for name, kind in PARTS.items()},
        **{name: from_plain(fields[name], document[name]) for name in NUMBERS},
    )
    return StoredFit(result=result, reference=from_plain(Reference | None, document["reference"]), provenance=document["provenance"])
