"""Checksums of a store: one of every tile, kept in its mark, and one of the store's description, kept among its attributes.

A chunk that is deleted reads as one that was never written, a chunk of another store reads without an error, and neither breaks a checksum
of chunks. So the mark of a tile is a checksum of its numbers, which every reading compares.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import xarray as xr

DESCRIPTION, COORDINATES = "sha256_of_description", "coordinate_arrays"
"""Attributes of the store."""


def tile_checksum(data: xr.Dataset) -> np.uint64:
    """64 bits of the SHA-256 of a tile's variables, never 0, which marks a tile that is not done.

    Args:
        data: the tile's variables, as made or as read; coordinates do not count.
    """
    digest = hashlib.sha256()
    for name in sorted(map(str, data.data_vars)):
        values = np.asarray(data[name].values)
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), values.dtype.type(np.nan), values)  # a chunk of these alone is not written
        values = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<")))
        digest.update(f"{name} {data[name].dims} {values.shape} {values.dtype.str}\n".encode())
        digest.update(values.tobytes())
    return np.uint64(int.from_bytes(digest.digest()[:8], "little") | 1)


def description_checksum(path: Path) -> str:
    """SHA-256 of everything in a store but its tiles: the description of every array, and the coordinates; in hexadecimal.

    Args:
        path: of the store, whose attribute `COORDINATES` names the arrays that hold coordinates.
    """
    digest, names = hashlib.sha256(), []
    for file in sorted(path.rglob("zarr.json")):
        document = json.loads(file.read_text(encoding="utf-8"))
        attributes = document.get("attributes", {})
        attributes.pop(DESCRIPTION, None)
        names += attributes.get(COORDINATES, [])
        digest.update(f"{file.relative_to(path)} {json.dumps(document, sort_keys=True)}\n".encode())
    for name in names:
        for file in sorted(part for part in (path / name / "c").rglob("*") if part.is_file() and part.suffix != ".partial"):
            digest.update(f"{file.relative_to(path)} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()
