"""NetCDF file `result.nc`, with variables that other programs can read.

One attribute holds everything but series as JSON, another a checksum of the content. Nothing is pickled.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from vibrojax.errors import InputError

FILE_NAME = "result.nc"
FIT, DIAGNOSIS = "fit", "diagnosis"
"""Kind of content: the name of the file's attribute."""
_COMMANDS = {FIT: "vibrojax fit", DIAGNOSIS: "vibrojax diagnose"}
_SCHEMA = 6
_CHECKSUM = "sha256_of_content"
"""Attribute: of all other attributes, and of every variable with its own."""

Series = dict[str, np.ndarray]
T = TypeVar("T")


def variable(dimensions: str | tuple[str, ...], values: np.ndarray, units: str, long_name: str, **more: str) -> xr.Variable:
    """A variable with units and description; booleans and long integers are converted, since NetCDF 3 has neither."""
    stored = values.astype(np.int8) if values.dtype == bool else values.astype(np.int32) if values.dtype.kind == "i" else values
    return xr.Variable(dimensions, stored, {"units": units, "long_name": long_name, **more}, {"_FillValue": None})


def floats(values: np.ndarray) -> np.ndarray:
    """Values as floats in native byte order; NetCDF has its own."""
    return values.astype(np.float64)


def dataset(*, kind: str, title: str, variables: dict[str, xr.Variable], document: dict[str, Any]) -> xr.Dataset:
    """Dataset of series and one JSON document, as stored in a file.

    Args:
        kind: `FIT` or `DIAGNOSIS`.
        title: of the dataset.
        variables: by name.
        document: all other content as plain data.
    """
    return xr.Dataset(variables, attrs={"title": title, kind: json.dumps({"schema": _SCHEMA} | document, allow_nan=False)})


def write_netcdf(found: xr.Dataset, path: Path) -> None:
    """Write a file; an existing one is replaced."""
    found.assign_attrs({_CHECKSUM: _checksum(found)}).to_netcdf(path, engine="scipy")


def read_netcdf(path: Path, builders: dict[str, Callable[[dict[str, Any], Series], T]]) -> T:
    """Read a file that `write_netcdf` wrote.

    Args:
        path: of the file.
        builders: by kind, the function that restores the object from document and series.

    Returns:
        What the builder of the file's kind returns.

    Raises:
        InputError: the file does not exist, is damaged, has another version, or holds none of these kinds.
    """
    again = f"run {' or '.join(_COMMANDS[kind] for kind in builders)} again"
    if not path.is_file():
        raise InputError(f"{path} does not exist: expected the {FILE_NAME} of a {' or a '.join(builders)}; {again}")
    try:
        with xr.open_dataset(path, engine="scipy", decode_cf=False) as data:
            kind = next((kind for kind in builders if kind in data.attrs), None)
            if kind is None:
                raise InputError(f"{path} is no result of a {' or a '.join(builders)}: {again}")
            document, stated = json.loads(data.attrs[kind]), data.attrs.pop(_CHECKSUM, None)
            if document["schema"] == _SCHEMA and stated != _checksum(data):
                raise InputError(f"{path} is damaged: its content is not that of its checksum; {again}")
            series = {str(name): np.array(one.values) for name, one in data.variables.items()}
        if document["schema"] != _SCHEMA:
            raise InputError(f"{path} is of schema {document['schema']}: expected {_SCHEMA}; {again}")
        return builders[kind](document, series)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{path} cannot be read as a result ({reason}): {again}") from error


def _checksum(found: xr.Dataset) -> str:
    """Of what a file holds, whatever the order of its bytes."""
    digest = hashlib.sha256()

    def add(name: Any, attributes: dict[Any, Any], one: xr.Variable | None = None) -> None:
        values = np.empty(0) if one is None else np.ascontiguousarray(one.values)
        plain = values.astype(values.dtype.newbyteorder("<"))
        words = {str(key): str(value) for key, value in sorted(attributes.items())}
        digest.update(json.dumps([str(name), plain.dtype.str, list(plain.shape), [] if one is None else list(one.dims), words]).encode())
        digest.update(plain.tobytes())

    add("", found.attrs)
    for name in sorted(found.variables, key=str):
        add(name, found.variables[name].attrs, found.variables[name])
    return digest.hexdigest()
