"""A study on disk while it grows: one Zarr store, tile by tile, that ends with the same bytes however often it was broken off.

Every tile is one chunk of each variable and each chunk file is moved into place whole (Zarr's local store does so). A tile counts as done
when its mark in `tile_done` is the checksum of its numbers, which is written after its chunks; every chunk file ends with a checksum of its
bytes (CRC-32C), which other programs that read Zarr compare as well. The store holds nothing about time or machine. The store itself is
made aside and moved into place, and a run holds a lock on the folder as long as it lives.

A chunk that is deleted reads as one that was never written, a chunk of another store reads without an error, and neither breaks a checksum
of chunks: so the mark of a tile is a checksum of its numbers, which every reading compares.
"""

import errno
import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.aside import locked, made_aside
from vibrojax.errors import InputError
from vibrojax.model_file import model_document
from vibrojax.studies.job import Job, Tile, tiles

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


_JOB, _DONE = "job", "tile_done"
_OF_A_RUN = ("seconds", "lanes_that_failed")
"""Attributes that are not the same for every tile, or every run."""
_FORMAT: Any = {"zarr_format": 3, "consolidated": False}


@contextmanager
def opened(path: Path, job: Job, first: Callable[[], xr.Dataset], notice: Callable[[str], None]) -> Iterator[np.ndarray]:
    """Hold the store of a job, made new where there is none.

    Arguments:
        path: of the store.
        job: the study.
        first: makes the first tile, from which a new store takes its shape.
        notice: called with a sentence for every tile that is damaged; such a tile counts as not done.

    Yields:
        Which tiles are done, one flag a tile.

    Raises:
        InputError: the store was begun with other settings, is none of ours, is damaged in what describes it, is in use, or its parent does
            not exist.
    """
    path = Path(path).absolute()
    lock = _locked(path) if path.exists() else _made(path, job, first())
    try:
        _check(path, job)
        for rest in path.rglob("*.partial"):
            rest.unlink(missing_ok=True)
        yield _whole_tiles(path, job, notice)
    finally:
        os.close(lock)


def put(path: Path, job: Job, tile: Tile, data: xr.Dataset) -> None:
    """Write one tile, then its mark; to be done by one process at a time for each tile."""
    import zarr

    data = data.drop_vars(list(data.coords))
    if tile.draw is not None:
        data = data.expand_dims("draw")
    data.to_zarr(path, region=_region(job, tile), mode="r+", **_FORMAT)
    zarr.open_array(path, path=_DONE, mode="r+")[tile.number] = tile_checksum(data)


def read(path: Path, job: Job) -> xr.Dataset:
    """All tiles as one data set, in memory.

    Raises:
        InputError: a tile is not as it was written.
    """
    with xr.open_zarr(path, chunks=None, **_FORMAT) as data:
        marks = data[_DONE].values
        whole = data.drop_vars(_DONE).load()
    for tile in tiles(job):
        if marks[tile.number] != tile_checksum(whole.isel(_region(job, tile))):
            raise InputError(f"{path}: {_named(job, tile)} was changed while it was read: expected no other writer; run the command again")
    for name in (_JOB, DESCRIPTION, COORDINATES):
        whole.attrs.pop(name)
    return whole


def state_before(path: Path, job: Job, tile: Tile) -> np.ndarray | None:
    """Where the stretch before a tile of a sweep ended; None where the tile begins the sweep."""
    if tile.after is None:
        return None
    way, part = tile.parts["direction"], tile.parts["values"]
    upwards = job.axes["direction"][way.start] == "up"
    place: dict[str, Any] = {"direction": way, job.dim("values"): part.start - 1 if upwards else part.stop}
    with xr.open_zarr(path, chunks=None, **_FORMAT) as data:
        return data["state"].isel(place | ({} if tile.draw is None else {"draw": tile.draw})).values


def _region(job: Job, tile: Tile) -> dict[str, slice]:
    """Where a tile lies in the store."""
    place = {job.dim(name): part for name, part in tile.parts.items()}
    return place if tile.draw is None else place | {"draw": slice(tile.draw, tile.draw + 1)}


def _named(job: Job, tile: Tile) -> str:
    """A tile in words."""
    parts = [f"{job.dim(name)} {job.axes[name][part][0]} to {job.axes[name][part][-1]}" for name, part in tile.parts.items()]
    return f"tile {tile.number + 1} ({', '.join(parts if tile.draw is None else [f'draw {tile.draw + 1}', *parts])})"


def _whole_tiles(path: Path, job: Job, notice: Callable[[str], None]) -> np.ndarray:
    """Which tiles are done and as they were written."""
    done = np.zeros(len(tiles(job)), dtype=bool)
    with xr.open_zarr(path, chunks=None, **_FORMAT) as data:
        for tile in tiles(job):
            try:
                mark = data[_DONE][tile.number].values
                done[tile.number] = mark != 0 and mark == tile_checksum(data.drop_vars(_DONE).isel(_region(job, tile)))
                damaged = bool(mark != 0) and not done[tile.number]
            except Exception:  # whatever a library finds wrong in a damaged chunk
                damaged = True
            if damaged:
                notice(f"{path}: {_named(job, tile)} is damaged; it is made again")
    return done


def _made(path: Path, job: Job, tile: xr.Dataset) -> int:
    """A new store, locked before anyone can see it."""
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    parent = path.parent
    if not parent.is_dir():
        raise InputError(f"cannot make the store {path}: {parent} is not a folder; make it, or name another store")
    try:
        with made_aside(path) as aside:
            empty, chunks = _template(job, tile)
            codecs = {"compressors": (ZstdCodec(), Crc32cCodec())}  # compression, and a checksum of what it gives
            encoding = {name: {"chunks": sizes} | codecs for name, sizes in chunks.items()} | dict.fromkeys(map(str, empty.coords), codecs)
            empty.to_zarr(aside.path, mode="w-", compute=False, encoding=encoding, **_FORMAT)
            zarr.open_group(aside.path, mode="r+", zarr_format=3).attrs[DESCRIPTION] = description_checksum(aside.path)
            os.rename(aside.path, path)
            return os.dup(aside.lock)
    except OSError as error:
        if error.errno in (errno.EEXIST, errno.ENOTEMPTY):  # another run was first
            return _locked(path)
        raise InputError(f"cannot make the store {path}: {error.strerror or error}; name another store") from error


def _template(job: Job, tile: xr.Dataset) -> tuple[xr.Dataset, dict[str, tuple[int, ...]]]:
    """The data set in full size with nothing in it, and the sizes of its chunks."""
    import dask.array

    blocks = {job.dim(name): length for name, length in job.blocks().items()}
    sizes = {**tile.sizes, **{job.dim(name): len(values) for name, values in job.axes.items()}}
    lead = {} if job.draws is None else {"draw": len(job.draws.values)}
    variables, chunks = {}, {}
    for name, part in tile.data_vars.items():
        dims = (*lead, *part.dims)
        chunks[str(name)] = tuple(1 if dim == "draw" else blocks.get(str(dim), sizes.get(dim, 0)) for dim in dims)
        shape = tuple(lead[str(dim)] if dim in lead else sizes[dim] for dim in dims)
        fill = np.nan if np.issubdtype(part.dtype, np.floating) else 0
        variables[name] = (dims, dask.array.full(shape, fill, dtype=part.dtype, chunks=chunks[str(name)]), part.attrs)
    number = len(tiles(job))
    marks = dask.array.zeros((number,), dtype=np.uint64, chunks=(1,))
    variables[_DONE] = (("tile",), marks, {"long_name": "checksum of the tile; 0: not done"})
    coords = {name: (part.dims, part.values, part.attrs) for name, part in tile.coords.items()}
    for name, values in job.axes.items():
        dim = job.dim(name)
        coords[dim] = ((dim,), values.astype(object) if name == "direction" else values, tile[dim].attrs)
    attrs = {name: value for name, value in tile.attrs.items() if name not in _OF_A_RUN}
    attrs |= {"model": json.dumps(model_document(job.model)), _JOB: json.dumps(job.document()), COORDINATES: sorted(map(str, coords))}
    return xr.Dataset(variables, coords, attrs), chunks | {_DONE: (1,)}


def _check(path: Path, job: Job) -> None:
    """Refuse a store that is not of this job, or whose description is not as it was written."""
    try:
        attributes = json.loads((path / "zarr.json").read_text(encoding="utf-8"))["attributes"]
        begun, written, found = json.loads(attributes[_JOB]), attributes[DESCRIPTION], description_checksum(path)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{path} is not a store of a study, or is damaged: expected a whole one, or nothing at that place; name another store"
        ) from error
    if written != found:
        raise InputError(f"{path} is damaged in what describes its arrays: expected it as it was written; name another store")
    now = json.loads(json.dumps(job.document()))
    differing = list(_differences(begun, now, ""))
    if differing:
        more = f", and {len(differing) - 1} more" if len(differing) > 1 else ""
        raise InputError(f"{path} was begun with other settings: {differing[0]}{more}; give the same ones, or name another store")


def _differences(begun: Any, now: Any, where: str) -> Iterator[str]:
    """What differs between two documents, in words."""
    if begun == now:
        return
    if isinstance(begun, dict) and isinstance(now, dict):
        for key in {**begun, **now}:
            yield from _differences(begun.get(key), now.get(key), f"{where}{'.' if where else ''}{key}")
        return
    yield f"{where} is {_short(begun)} in the store, {_short(now)} now"


def _short(value: Any) -> str:
    """A list by its length and ends."""
    if isinstance(value, list) and len(value) > 3 and not isinstance(value[0], list):
        return f"{len(value)} values from {value[0]!r} to {value[-1]!r}"
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _locked(path: Path) -> int:
    """A lock on a folder that ends with the process."""
    try:
        return locked(path, f"{path} is in use: expected a store that no other run works on; wait for that run, or end it")
    except OSError as error:
        raise InputError(f"{path} cannot be opened ({error.strerror}): expected the folder of a store; name another store") from error
