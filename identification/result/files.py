"""Files of a fit: `fit.json`, every number with its unit in strict JSON, and `result.nc`, from which its page is drawn again."""

import contextlib
import dataclasses
import hashlib
import importlib.metadata
import json
import math
import platform
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from identification.experiment import Experiment, ParameterOption
from identification.result.reference import Reference
from identification.result.result import FIXED, OK, FitResult, ParameterEstimate, RecordFit, residual
from identification.result.store import Variables, dataset, from_plain, to_plain, with_samples
from vibrojax.json_file import Table, read_json, write_json
from vibrojax.model_file import model_document


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredFit:
    """What the page of a fit is drawn from: the result, known values beside it or None, and the provenance as in `fit.json`."""

    result: FitResult
    reference: Reference | None
    provenance: Mapping[str, Any]


def fit_dataset(stored: StoredFit) -> xr.Dataset:
    """Dataset of a fit: measured, predicted and residual series of every record over its time, SI; everything else in one attribute."""
    result, variables = stored.result, Variables()
    document = to_plain(stored, variables)
    variables |= residuals(result.records, "record") | residuals(result.held_back, "held_back")
    return dataset("fit", document, variables, f"{result.experiment.name}: fitted impact model")


def stored_fit(document: dict[str, Any], variables: Mapping[str, np.ndarray]) -> StoredFit:
    """Restore a fit from document and variables, for `store.read_stored`."""
    stored = from_plain(StoredFit, document, variables)
    samples = {each.file: (each.time, each.measured) for each in (*stored.result.records, *stored.result.held_back)}
    experiment = with_samples(stored.result.experiment, samples)
    return dataclasses.replace(stored, result=dataclasses.replace(stored.result, experiment=experiment))


def residuals(records: tuple[RecordFit, ...], path: str) -> Variables:
    """Residuals of fitted records, for other programs, as variables `path1_residual_CHANNEL`, ..."""
    return {
        f"{path}{number}_residual_{name}": xr.Variable(
            f"{path}{number}_time",
            residual(record, name),
            {"units": "1", "long_name": f"{name}, measured less model over the noise", "record": record.file},
            {"_FillValue": None},
        )
        for number, record in enumerate(records, start=1)
        for name in record.measured
    }


def provenance(result: FitResult) -> dict[str, Any]:
    """Provenance of a result: as `origin`, the seed, how the records were prepared, and the earlier fit from which it started."""
    prepared = {record.file: to_plain(record.preparation, {}) for record in result.experiment.records if record.preparation.words}
    earlier = {} if result.started_from is None else {"earlier_fit": dataclasses.asdict(result.started_from)}
    return origin(result.experiment, result.seconds, seed=result.seed) | ({"preparation": prepared} if prepared else {}) | earlier


def origin(experiment: Experiment, seconds: Mapping[str, float], **more: Any) -> dict[str, Any]:
    """Where results come from: versions, sha256 of every file that was read, more if given, wall time by stage in s."""
    hashes = {"experiment.toml": experiment.sha256} | {record.file: record.sha256 for record in experiment.records}
    versions: dict[str, str | None] = {"python": platform.python_version()}
    for name in ("vibrojax", "jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy"):
        versions[name] = None
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return {"versions": versions, "sha256": hashes, **more, "seconds": plain(seconds)}


class Clock:
    """Wall time by stage, s."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Record the wall time of a stage that ends."""
        last, self._last = self._last, time.perf_counter()
        self.seconds[stage] = self._last - last


def fit_json(result: FitResult) -> dict[str, Any]:
    """Fit result as plain data for `fit.json`, parameters by name in the order of the tables; what is not finite becomes None."""
    document = {
        "schema": 1,
        "experiment": result.experiment.name,
        "law": result.model.law.name,
        "suspension": result.model.suspension.name,
        "load": model_document(result.model).get("load"),
        "recorder": model_document(result.model).get("recorder", []),
        "effects": result.added,
        "parameters": {p.spec.name: _parameter(p) | _wish(result, p.spec.name) for p in result.parameters},
        "derived": {d.name: {"value": d.value, "stderr": d.stderr, "unit": d.unit} for d in result.derived},
        "correlation": {"names": result.correlated, "matrix": result.correlation},
        "chi2_reduced": result.chi2_reduced,
        "degrees_of_freedom": result.degrees,
        "converged": result.converged,
        "discretisation": result.discretisation,
        "smoothed": None if result.smoothing is None else {"smoothing": result.smoothing, "parameters": result.smoothed},
        "posterior": None if result.posterior is None else result.posterior.document(),
        "profiles": result.profiles,
        "likelihood": result.likelihood,
        "unrest": None if result.unrest is None else result.unrest.document(),
        "between_records": {one.name: one.document() for one in result.between_records},
        "ring_downs": result.ring_downs,
        "reading_error": result.reading_error,
        "force_share": result.force_share,
        "warnings": result.warnings,
        "records": [_record(record) for record in result.records],
        "held_back": [_record(record) for record in result.held_back],
        "provenance": provenance(result),
    }
    return plain(document)


def read_estimates(path: Path) -> dict[str, tuple[float, str]]:
    """Value and unit of every parameter of an earlier fit, by name, from its `fit.json` or its folder; what was not finite is left out.

    Raises:
        InputError: there is no such file, or it is no result of a fit.
    """
    file, expected = estimates_file(path), "the fit.json of an earlier fit, or its folder"
    table = Table(values=read_json(file, expected), where=str(file), expected=expected).table("parameters")
    found = {name: table.table(name) for name in table.values}
    return {
        name: (one.number("value", zero=True, negative=True), one.text("unit"))
        for name, one in found.items()
        if one.needed("value") is not None
    }


def estimates_file(path: Path) -> Path:
    """The `fit.json` of an earlier fit, from its path or that of its folder."""
    return path / "fit.json" if path.is_dir() else path


def state_files(stating: Path, folder: Path) -> None:
    """State in `fit.json` or `diagnosis.json`, `stating`, the SHA-256 of each other file in the folder, which receives it anew.

    Files that it already states stay, with the checksum of that in the folder where there is one.
    """
    document = json.loads(stating.read_text(encoding="utf-8"))
    others = sorted(path for path in folder.iterdir() if path.name != stating.name)
    found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in others}
    document["files"] = document.get("files", {}) | found
    write_json(document, folder / stating.name)


def plain(value: Any) -> Any:
    """A value as plain JSON data: data classes become tables, arrays lists, NumPy and JAX numbers Python's, what is not finite None.

    Example:
        >>> import numpy as np
        >>> plain({"a": np.array([1.0, np.nan]), 2: (np.True_, np.int64(3))})
        {'a': [1.0, None], '2': [True, 3]}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if value is None or isinstance(value, bool | str):
        return value
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return value if isinstance(value, int) else str(value)


def _parameter(estimate: ParameterEstimate) -> dict[str, Any]:
    """One parameter as plain data; one that is not identifiable has neither error nor interval, whatever the estimate holds."""
    known = estimate.status == OK
    return {
        "value": estimate.value,
        "stderr": estimate.stderr if known else None,
        "ci95": estimate.ci95 if known else None,
        "unit": estimate.spec.unit,
        "status": estimate.status,
        "reason": estimate.reason,
        "initial": estimate.initial,
        "interval": estimate.interval,
        "symbol": estimate.spec.symbol,
        "estimated": estimate.status != FIXED,
        "std_between_records": estimate.between,
    }


def _wish(result: FitResult, name: str) -> dict[str, Any]:
    """What the operator wanted of a parameter beside start and `fixed`."""
    option = result.experiment.parameters.get(name, ParameterOption())
    return {"bounds": option.bounds, "prior": option.prior}


def _record(record: RecordFit) -> dict[str, Any]:
    return {
        "file": record.file,
        "kind": record.kind,
        "gap": record.gap,
        "samples": record.samples,
        "windows": record.windows,
        "nuisances": {n.name: {"value": n.value, "stderr": n.stderr, "unit": n.unit} for n in record.nuisances},
        "nrmse": record.nrmse,
        "chi2_reduced": record.chi2_reduced,
        "noise": record.noise,
        "notices": record.notices,
    } | ({"horizons": record.horizons} if record.horizons else {})
