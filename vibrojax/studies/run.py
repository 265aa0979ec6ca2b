"""Make a study: at once, or tile by tile into a store, here or on a cluster."""

import json
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from vibrojax.batch.points import failures
from vibrojax.errors import InputError
from vibrojax.model_file import model_document
from vibrojax.studies.job import Job, Tile, evaluate, everything, tiles
from vibrojax.studies.quantiles import stacked, summary
from vibrojax.studies.store import opened, put, read, state_before

Progress = Callable[[int, int], None]
"""Called with the number of operating points done, and of those done before this run."""


def make(
    job: Job,
    *,
    store: Path | None = None,
    client: Any = None,
    progress: Progress = lambda done, before: None,
    notice: Callable[[str], None] = warnings.warn,
) -> xr.Dataset:
    """Make a study, or what is left of it.

    Arguments:
        job: the study.
        store: Zarr store that receives tile after tile; an unfinished one is finished. None: all in memory.
        client: `dask.distributed.Client` whose workers make and write the tiles, on a file system that they share; None works here.
        progress: called after every tile.
        notice: called with a sentence for every tile of the store that is damaged, and is made again.

    Returns:
        The study; with draws, its quantiles and probabilities over them (see `quantiles`).

    Raises:
        InputError: bad settings, a store of other settings, workers of other versions.
    """
    if store is None:
        if client is not None:
            raise InputError("a cluster is given without a store: expected the place where its workers put their tiles; name a store")
        return _finished(job, _in_memory(job, progress))
    if not job.axes and job.draws is None:
        raise InputError(f"{job.study} is one operating point: there is nothing to resume; leave the store out")
    store = Path(store).absolute()
    plan = tiles(job)
    began: list[xr.Dataset] = []

    def first() -> xr.Dataset:
        began.append(evaluate(job, plan[0]) if client is None else client.submit(evaluate, job, plan[0], pure=False).result())
        return began[0]

    with opened(store, job, first, notice) as done:
        if began:
            put(store, job, plan[0], began[0])
            done[0] = True
        left = [tile for tile in plan if not done[tile.number]]
        before = 0 if began else sum(job.size(tile) for tile in plan if done[tile.number])
        made = job.lanes - sum(job.size(tile) for tile in left)
        progress(made, before)
        for tile in _here(job, store, left) if client is None else _on_cluster(job, store, left, client):
            made += job.size(tile)
            progress(made, before)
        return _finished(job, read(store, job))


def _in_memory(job: Job, progress: Progress) -> xr.Dataset:
    if job.draws is None:
        return everything(job, None)
    found, count = [], len(job.draws.values)
    for draw in range(count):
        found.append(everything(job, draw).expand_dims("draw"))
        progress((draw + 1) * job.lanes // count, 0)
    return stacked(found)


def _here(job: Job, store: Path, left: list[Tile]) -> Iterator[Tile]:
    """Each tile when it has been made and put into the store."""
    for tile in left:
        put(store, job, tile, evaluate(job, tile, before=state_before(store, job, tile)))
        yield tile


def _on_cluster(job: Job, store: Path, left: list[Tile], client: Any) -> Iterator[Tile]:
    """The same, where every tile is a task; a stretch of a sweep waits for the one before."""
    from dask.distributed import as_completed

    versions, futures = job.document()["versions"], dict[int | None, Any]()
    for tile in left:
        futures[tile.number] = client.submit(_one, job, store, tile, versions, futures.get(tile.after), pure=False)
    tile_of = {futures[tile.number].key: tile for tile in left}
    for future in as_completed(futures.values(), raise_errors=True):
        future.result()
        yield tile_of[future.key]


def _one(job: Job, store: Path, tile: Tile, versions: dict[str, str], after: Any) -> None:
    """One tile on a worker, which runs as many of them at a time as it has threads."""
    here = job.document()["versions"]
    if here != versions:
        raise InputError(f"a worker has {here}, this process {versions}: expected the same; set the workers up anew")
    if not store.is_dir():
        raise InputError(f"a worker does not see {store}: expected a folder that all machines share; name a store there")
    put(store, job, tile, evaluate(job, tile, before=state_before(store, job, tile), threads=1))


def _finished(job: Job, data: xr.Dataset) -> xr.Dataset:
    """What is said of the whole."""
    if job.draws is not None:
        found = summary(job, data)
    else:
        found = job.kind.after(job.model, job.kind.whole(data))
    failed = failures(data["result"].values) if "result" in data else {}
    return found.assign_attrs(model=json.dumps(model_document(job.model)), lanes_that_failed=json.dumps(failed))
