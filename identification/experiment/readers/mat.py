"""MATLAB files: version 5 and older through SciPy, version 7.3 as the HDF5 file that it is."""

from collections.abc import Set as AbstractSet
from pathlib import Path

import h5py
from scipy.io import loadmat, whosmat

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_claim, check_shape
from identification.experiment.readers.base import AbstractReader, Columns, as_column
from identification.experiment.readers.hdf5 import read_hdf5

NUMERIC_CLASSES = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")


class MatReader(AbstractReader):
    """Reads numeric row or column vectors of a MATLAB workspace; one variable per channel."""

    suffixes = (".mat",)
    format = "MATLAB"
    apart = True

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        if h5py.is_hdf5(path):
            return read_hdf5(path, wanted)
        listing = whosmat(path)
        chosen = [entry for entry in listing if entry[0] in wanted]
        for name, shape, kind in chosen:
            check_shape(shape, name)
            if kind not in NUMERIC_CLASSES:
                raise ExperimentError(f"column {shown(name)} holds {kind}: expected integers or real numbers; store it as double")
        check_claim(sum(8 * max(shape) for _, shape, _ in chosen), path.stat().st_size)
        names = [name for name, _, _ in chosen]
        arrays = loadmat(path, variable_names=names) if names else {}
        return Columns(names=tuple(entry[0] for entry in listing), values={name: as_column(arrays[name], name) for name in names})
