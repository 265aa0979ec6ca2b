"""HDF5 files, MATLAB's version 7.3 included."""

from collections.abc import Set as AbstractSet
from math import prod
from pathlib import Path

import h5py
import numpy as np

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.readers.base import AbstractReader, Columns, as_column, check_numeric, check_shape
from identification.experiment.readers.limits import check_claim


class Hdf5Reader(AbstractReader):
    """Reads one-dimensional data sets, at the top level or in the file's only group.

    Links to other files, external storage and virtual data sets are refused: a record is one file.
    """

    suffixes = (".h5", ".hdf5")
    format = "HDF5"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        return read_hdf5(path, wanted)


def read_hdf5(path: Path, wanted: AbstractSet[str]) -> Columns:
    """Read the wanted data sets of an HDF5 file.

    Args:
        path: the file.
        wanted: names of data sets.

    Returns:
        Names of all data sets, and the wanted ones.

    Raises:
        ExperimentError: a wanted data set is not a plain column, or claims more than the file can hold.
    """
    stored = path.stat().st_size
    with h5py.File(path, "r", locking=False) as file:
        datasets = _datasets(file)
        chosen = {name: dataset for name, dataset in datasets.items() if name in wanted}
        for name, dataset in chosen.items():
            _check(dataset, name)
        check_claim(8 * sum(max(prod(dataset.shape), prod(dataset.chunks or ())) for dataset in chosen.values()), stored, "the file")
        values = {name: as_column(np.asarray(dataset[()]), name) for name, dataset in chosen.items()}
    return Columns(names=tuple(datasets), values=values)


def _datasets(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Find the data sets at the top level; where there is none, those of the only group."""
    members = _members(file)
    datasets = {name: item for name, item in members.items() if isinstance(item, h5py.Dataset)}
    groups = {name: item for name, item in members.items() if isinstance(item, h5py.Group)}
    if datasets:
        return datasets
    if len(groups) != 1:
        raise ExperimentError(
            f"the file has no data set at the top level and {len(groups)} groups ({listed(groups)}): expected data sets at the top level "
            "or in one group; export one group"
        )
    (group,) = groups.values()
    return {name: item for name, item in _members(group).items() if isinstance(item, h5py.Dataset)}


def _members(group: h5py.Group) -> dict[str, h5py.Group | h5py.Dataset]:
    """List what lies in a group itself; MATLAB's bookkeeping ("#refs#") and links are left out."""
    own = [str(name) for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
    members = {name: group[name] for name in own if not name.startswith("#")}
    return {name: item for name, item in members.items() if isinstance(item, h5py.Group | h5py.Dataset)}


def _check(dataset: h5py.Dataset, name: str) -> None:
    """Refuse whatever is not a plain column of this file."""
    if dataset.is_virtual or dataset.external:
        raise ExperimentError(f"column {shown(name)} is stored in another file: expected all data in the record itself; copy it in")
    if dataset.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"struct", b"logical"):
        raise ExperimentError(f"column {shown(name)} holds no numbers: expected integers or real numbers; store it as double")
    if dataset.shape is None:
        raise ExperimentError(f"column {shown(name)} is empty: expected one dimension; store one array per channel")
    check_shape(dataset.shape, name)
    check_numeric(dataset.dtype, name)
