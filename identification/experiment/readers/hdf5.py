"""HDF5 files, MATLAB's version 7.3 included."""

from collections.abc import Set as AbstractSet
from math import prod
from pathlib import Path

import h5py
import numpy as np

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.limits import check_claim, check_numeric, check_shape
from identification.experiment.readers.base import AbstractReader, Columns, as_column

MOST_LEVELS = 8
"""Of groups in groups."""


class Hdf5Reader(AbstractReader):
    """Reads one-dimensional data sets at the top level and in groups, those in groups by dotted name ("cell.force").

    Links to other files, external storage and virtual data sets are refused: a record is one file.
    """

    suffixes = (".h5", ".hdf5")
    format = "HDF5"
    apart = True

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        return read_hdf5(path, wanted)


def read_hdf5(path: Path, wanted: AbstractSet[str]) -> Columns:
    """Read the wanted data sets of an HDF5 file, and the names of all; refused is what is no plain column or claims too much."""
    stored = path.stat().st_size
    with h5py.File(path, "r", locking=False) as file:
        datasets = _datasets(file)
        chosen = {name: _checked(dataset, name) for name, dataset in datasets.items() if name in wanted}
        check_claim(8 * sum(max(prod(dataset.shape), prod(dataset.chunks or ())) for dataset in chosen.values()), stored)
        values = {name: as_column(np.asarray(dataset[()]), name) for name, dataset in chosen.items()}
    return Columns(names=tuple(datasets), values=values)


def _datasets(file: h5py.File) -> dict[str, "h5py.Dataset | None"]:
    """Find the data sets at the top level, and those in groups, MATLAB's structs, by dotted name; None stands for a link.

    Where all lie in one group, its name is left out.
    """
    members = _members(file)
    groups = {name: item for name, item in members.items() if isinstance(item, h5py.Group)}
    datasets = {name: item for name, item in members.items() if not isinstance(item, h5py.Group)}
    if len(groups) == 1 and not any(isinstance(item, h5py.Dataset) for item in datasets.values()):
        (group,) = groups.values()
        datasets |= _within(group, "")
    else:
        for name, group in groups.items():
            datasets |= _within(group, f"{name}.")
    if not datasets:
        raise ExperimentError(f"the file has no data set in its {len(groups)} groups ({listed(groups)}): expected some; export it again")
    return datasets


def _within(group: h5py.Group, path: str, above: frozenset[object] = frozenset()) -> dict[str, "h5py.Dataset | None"]:
    """The data sets of a group and of those below it; a link back to a group `above`, by its identity in the file, is passed over."""
    above |= {group.id}
    found: dict[str, h5py.Dataset | None] = {}
    for name, item in _members(group).items():
        if not isinstance(item, h5py.Group):
            found[f"{path}{name}"] = item
        elif item.id not in above and len(above) < MOST_LEVELS:
            found |= _within(item, f"{path}{name}.", above)
    return found


def _members(group: h5py.Group) -> dict[str, "h5py.Group | h5py.Dataset | None"]:
    """List what lies in a group itself, None for a link; MATLAB's bookkeeping ("#refs#") is left out."""
    members: dict[str, h5py.Group | h5py.Dataset | None] = {}
    for name in (str(name) for name in group if not str(name).startswith("#")):
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            members[name] = None
        elif isinstance(item := group[name], h5py.Group | h5py.Dataset):
            members[name] = item
    return members


def _checked(dataset: "h5py.Dataset | None", name: str) -> h5py.Dataset:
    """Refuse whatever is not a plain column of this file."""
    if dataset is None:
        raise ExperimentError(f"column {shown(name)} is a link: expected the data set itself in the record; copy it in")
    if dataset.is_virtual or dataset.external:
        raise ExperimentError(f"column {shown(name)} is stored in another file: expected all data in the record itself; copy it in")
    if dataset.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"struct", b"logical"):
        raise ExperimentError(f"column {shown(name)} holds no numbers: expected integers or real numbers; store it as double")
    if dataset.shape is None:
        raise ExperimentError(f"column {shown(name)} is empty: expected one dimension; store one array per channel")
    check_shape(dataset.shape, name)
    check_numeric(dataset.dtype, name)
    return dataset
