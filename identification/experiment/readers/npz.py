"""NumPy archives; nothing in them is ever unpickled."""

import zipfile
from collections.abc import Set as AbstractSet
from math import prod
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import check_claim, check_numeric, check_shape
from identification.experiment.readers.base import AbstractReader, Columns, as_column

MEMBER_SUFFIX = ".npy"


class NpzReader(AbstractReader):
    """Reads one-dimensional arrays of an archive, one per channel; object arrays are refused."""

    suffixes = (".npz",)
    format = "NumPy archive"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        with zipfile.ZipFile(path) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(MEMBER_SUFFIX)]
            names = [info.filename.removesuffix(MEMBER_SUFFIX) for info in members]
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
