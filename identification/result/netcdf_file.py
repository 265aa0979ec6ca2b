"""`result.nc`: a NetCDF file whose variables other programs read.

What is no series stands in one attribute, as JSON. Nothing is pickled.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from vibrojax.errors import InputError

FILE_NAME = "result.nc"
FIT, DIAGNOSIS = "fit", "diagnosis"
"""What a file holds: the name of its attribute."""
_COMMANDS = {FIT: "vibrojax fit", DIAGNOSIS: "vibrojax diagnose"}
_SCHEMA = 1

Series = dict[str, np.ndarray]
T = TypeVar("T")


def variable(dimensions: str | tuple[str, ...], values: np.ndarray, units: str, long_name: str, **more: str) -> xr.Variable:
    """A described variable; NetCDF 3 has neither booleans nor long integers."""
    stored = values.astype(np.int8) if values.dtype == bool else values.astype(np.int32) if values.dtype.kind == "i" else values
    return xr.Variable(dimensions, stored, {"units": units, "long_name": long_name, **more}, {"_FillValue": None})


def floats(values: np.ndarray) -> np.ndarray:
    """In the machine's own byte order; NetCDF has its own."""
    return values.astype(np.float64)


def dataset(*, kind: str, title: str, variables: dict[str, xr.Variable], document: dict[str, Any]) -> xr.Dataset:
    """What a file holds.

    Args:
        kind: `FIT` or `DIAGNOSIS`.
        title: for whoever opens it.
        variables: by name.
        document: all else, plain.
    """
    return xr.Dataset(variables, attrs={"title": title, kind: json.dumps({"schema": _SCHEMA} | document, allow_nan=False)})


def write_netcdf(found: xr.Dataset, path: Path) -> None:
    """Write a file; one that is there is replaced."""
    found.to_netcdf(path, engine="scipy")


def read_netcdf(path: Path, builders: dict[str, Callable[[dict[str, Any], Series], T]]) -> T:
    """Read a file that `write_netcdf` wrote.

    Args:
        path: of the file.
        builders: by kind, what puts everything together again from document and series.

    Returns:
        What the builder of the file's kind returns.

    Raises:
        InputError: the file is not there, damaged, of another version, or of none of these kinds.
    """
    again = f"run {' or '.join(_COMMANDS[kind] for kind in builders)} again"
    if not path.is_file():
        raise InputError(f"{path} does not exist: expected the {FILE_NAME} of a {' or a '.join(builders)}; {again}")
    try:
        with xr.open_dataset(path, engine="scipy", decode_cf=False) as data:
            kind = next((kind for kind in builders if kind in data.attrs), None)
            if kind is None:
                raise InputError(f"{path} is no result of a {' or a '.join(builders)}: {again}")
            document = json.loads(data.attrs[kind])
            series = {str(name): np.array(one.values) for name, one in data.variables.items()}
        if document["schema"] != _SCHEMA:
            raise InputError(f"{path} is of schema {document['schema']}: expected {_SCHEMA}; {again}")
        return builders[kind](document, series)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file leads to
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{path} cannot be read as a result ({reason}): {again}") from error
