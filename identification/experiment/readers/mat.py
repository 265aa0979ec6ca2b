"""MATLAB files: version 5 and older through SciPy, version 7.3 as the HDF5 file that it is; fields of structs by dotted name."""

from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from pathlib import Path

import h5py
import numpy as np
from scipy.io import loadmat, whosmat

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_claim, check_shape
from identification.experiment.readers.base import AbstractReader, Columns, as_column
from identification.experiment.readers.hdf5 import read_hdf5

NUMERIC_CLASSES = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
UNIT_FIELDS = ("unit", "units")
"""Fields of a struct that state the unit of the columns beside them."""


class MatReader(AbstractReader):
    """Reads numeric row or column vectors of a MATLAB workspace, one for each channel; a field of a struct bears its path, "data.laser"."""

    suffixes = (".mat",)
    format = "MATLAB"
    apart = True

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        if h5py.is_hdf5(path):
            return read_hdf5(path, wanted)
        listing = whosmat(path)
        structs = [name for name, shape, kind in listing if kind == "struct" and shape == (1, 1)]
        fields, units = _fields(loadmat(path, variable_names=structs) if structs else {}, structs)
        chosen = [entry for entry in listing if entry[0] in wanted]
        for name, shape, kind in chosen:
            check_shape(shape, name)
            if kind not in NUMERIC_CLASSES:
                raise ExperimentError(f"column {shown(name)} holds {kind}: expected integers or real numbers; store it as double")
        check_claim(sum(8 * max(shape) for _, shape, _ in chosen), path.stat().st_size)
        names = [name for name, _, _ in chosen]
        arrays = loadmat(path, variable_names=names) if names else {}
        arrays |= {name: values for name, values in fields.items() if name in wanted}
        return Columns(
            names=(*(name for name, _, _ in listing if name not in structs), *fields),
            values={name: as_column(arrays[name], name) for name in (*names, *fields) if name in arrays},
            units={name: unit for name, unit in units.items() if name in wanted},
        )


def _fields(workspace: dict[str, np.ndarray], structs: list[str]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Vectors of numbers in structs, and units, by path."""
    fields, units = {}, {}
    for path, values, unit in (found for name in structs for found in _within(name, workspace[name])):
        fields[path] = values
        if unit:
            units[path] = unit
    return fields, units


def _within(path: str, struct: np.ndarray) -> Iterator[tuple[str, np.ndarray, str]]:
    """Path, numbers and unit of each vector in a struct and those below it."""
    if struct.dtype.names is None or struct.size != 1:
        return
    one = struct.reshape(-1)[0]
    members = {name: one[name] for name in struct.dtype.names if isinstance(one[name], np.ndarray)}
    unit = next((str(members[name].reshape(-1)[0]) for name in UNIT_FIELDS if name in members and members[name].dtype.kind == "U"), "")
    for name, values in members.items():
        if values.dtype.names is not None:
            yield from _within(f"{path}.{name}", values)
        elif values.dtype.kind in "iuf" and values.size > 1 and max(values.shape) == values.size:
            yield f"{path}.{name}", values, unit
