"""Files of arrays, one for each channel: NumPy archives, HDF5, and MATLAB, whose version 7.3 is HDF5."""

import zipfile
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from math import prod
from pathlib import Path

import h5py
import numpy as np
from jaxtyping import Float64
from scipy.io import loadmat, whosmat

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.limits import check_claim, check_numeric, check_shape
from identification.experiment.readers.base import AbstractReader, Columns, as_column


class NpzReader(AbstractReader):
    """Reads one-dimensional arrays of an archive, one per channel; object arrays are refused."""

    suffixes = (".npz",)
    format = "NumPy archive"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        with zipfile.ZipFile(path) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            names = [info.filename.removesuffix(".npy") for info in members]
            for place, name in enumerate(names):
                if name in names[:place]:
                    raise ExperimentError(f"array {shown(name)} is there twice: expected different names; rename one")
            chosen = {name: info for name, info in zip(names, members, strict=True) if name in wanted}
            check_claim(sum(info.file_size for info in chosen.values()), path.stat().st_size)
            values = {name: _column(archive, info, name) for name, info in chosen.items()}
        return Columns(names=tuple(names), values=values)


def _column(archive: zipfile.ZipFile, info: zipfile.ZipInfo, name: str) -> Float64[np.ndarray, " samples"]:
    """Check an array's header against the bytes that follow it, and only then read it."""
    with archive.open(info) as stream:
        old = np.lib.format.read_magic(stream) == (1, 0)
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream) if old else np.lib.format.read_array_header_2_0(stream)
        if dtype.hasobject:
            raise ExperimentError(f"array {shown(name)} holds Python objects: expected integers or real numbers; store it as float64")
        check_numeric(dtype, name)
        check_shape(shape, name)
        claimed, stored = prod(shape) * dtype.itemsize, info.file_size - stream.tell()
        if claimed != stored:
            raise ExperimentError(f"array {shown(name)} claims {claimed} bytes and holds {stored}: the file is damaged, export it again")
    with archive.open(info) as stream:
        return as_column(np.lib.format.read_array(stream, allow_pickle=False), name)


class Hdf5Reader(AbstractReader):
    """Reads one-dimensional data sets at the top level and in groups, those in groups by dotted name ("cell.force").

    Links to other files, external storage and virtual data sets are refused: a record is one file.
    """

    suffixes = (".h5", ".hdf5")
    format = "HDF5"
    apart = True

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        with h5py.File(path, "r", locking=False) as file:
            datasets = _datasets(file)
            chosen = {name: _checked(dataset, name) for name, dataset in datasets.items() if name in wanted}
            claimed = 8 * sum(max(prod(dataset.shape), prod(dataset.chunks or ())) for dataset in chosen.values())
            check_claim(claimed, path.stat().st_size)
            values = {name: as_column(np.asarray(dataset[()]), name) for name, dataset in chosen.items()}
        return Columns(names=tuple(datasets), values=values)


def _datasets(file: h5py.File) -> dict[str, "h5py.Dataset | None"]:
    """Find the data sets at the top level, and those in groups, MATLAB's structs, by dotted name; None stands for a link.

    Where all lie in one group, its name is left out.
    """
    members = _members(file)
    groups = {name: item for name, item in members.items() if isinstance(item, h5py.Group)}
    datasets = {name: item for name, item in members.items() if not isinstance(item, h5py.Group)}
    alone = len(groups) == 1 and not any(isinstance(item, h5py.Dataset) for item in datasets.values())
    for name, group in groups.items():
        datasets |= _within(group, "" if alone else f"{name}.")
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
        elif item.id not in above and len(above) < 8:
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


NUMERIC_CLASSES = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")


class MatReader(AbstractReader):
    """Reads numeric row or column vectors of a MATLAB workspace, one for each channel; a field of a struct bears its path, "data.laser"."""

    suffixes = (".mat",)
    format = "MATLAB"
    apart = True

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        if h5py.is_hdf5(path):
            return Hdf5Reader().read(path, wanted)
        listing = whosmat(path)
        structs = [name for name, shape, kind in listing if kind == "struct" and shape == (1, 1)]
        workspace = loadmat(path, variable_names=structs) if structs else {}
        found = [vector for name in structs for vector in _in_struct(name, workspace[name])]
        fields = {name: values for name, values, _ in found}
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
            units={name: unit for name, _, unit in found if unit and name in wanted},
        )


def _in_struct(path: str, struct: np.ndarray) -> Iterator[tuple[str, np.ndarray, str]]:
    """Path, numbers and unit of each vector in a struct and those below it."""
    if struct.dtype.names is None or struct.size != 1:
        return
    one = struct.reshape(-1)[0]
    members = {name: one[name] for name in struct.dtype.names if isinstance(one[name], np.ndarray)}
    unit = next(
        (str(members[name].reshape(-1)[0]) for name in ("unit", "units") if name in members and members[name].dtype.kind == "U"), ""
    )
    for name, values in members.items():
        if values.dtype.names is not None:
            yield from _in_struct(f"{path}.{name}", values)
        elif values.dtype.kind in "iuf" and values.size > 1 and max(values.shape) == values.size:
            yield f"{path}.{name}", values, unit
