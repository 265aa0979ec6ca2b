"""A study made in tiles is the study, wherever its tiles are made and however often it is broken off."""

import fcntl
import os
import random
import signal
import time

import numpy as np
import pytest
import xarray as xr

from benchmarks.resume import contents, marks
from tests.batch.rigs import AMPLITUDE, model
from vibrojax.batch import Span
from vibrojax.errors import InputError
from vibrojax.studies.draws import Draws
from vibrojax.studies.job import Job, tiles
from vibrojax.studies.run import make

SHORT = Span(transient=24, recorded=8)


def peterka_job(points: int = 4, **settings) -> Job:
    plane = {"clearance": np.array([0.2, 0.6, 1.0]), "ratio": np.array([1.4, 1.5, 2.5, 3.2])}
    return Job(study="peterka", model=model(), axes=plane, settings={"base_amplitude": AMPLITUDE, "span": SHORT} | settings, points=points)


def sweep_job(**more) -> Job:
    settings = {"parameter": "gap", "base_amplitude": AMPLITUDE, "frequency_hz": 7.0, "span": SHORT}
    return Job(study="bifurcation", model=model(), axes={"values": np.linspace(2e-3, 8e-3, 7)}, settings=settings, **{"points": 3} | more)


def check_same(found: xr.Dataset, plain: xr.Dataset) -> None:
    """The same but for rounding, with the same labels."""
    assert set(found.data_vars) == set(plain.data_vars) and set(found.coords) == set(plain.coords)
    for name, part in plain.variables.items():
        assert found[name].dims == part.dims and found[name].attrs == part.attrs
        if part.dtype.kind == "f":
            scale = np.nanmax(np.abs(part.values), initial=1e-12)
            np.testing.assert_allclose(found[name].values, part.values, rtol=1e-6, atol=1e-6 * scale)
        else:
            np.testing.assert_array_equal(found[name].values, part.values)
    assert {name: value for name, value in plain.attrs.items() if name != "seconds"} == found.attrs


class Stop(Exception):
    """A study broken off."""


def broken_off(job: Job, store, after: int) -> None:
    """Make some tiles, then fail."""
    calls = []

    def progress(done: int, before: int) -> None:
        calls.append(done)
        if len(calls) == after:
            raise Stop

    with pytest.raises(Stop):
        make(job, store=store, progress=progress)


@pytest.mark.parametrize("job", [peterka_job(lyapunov_cycles=0), sweep_job()], ids=["map", "sweep"])
def test_tiles_make_the_study_and_a_broken_one_is_resumed_to_the_same_bytes(job, tmp_path):
    plain = make(job)
    whole = make(job, store=tmp_path / "whole.zarr")
    check_same(whole, plain)
    broken_off(job, tmp_path / "broken.zarr", 2)
    assert 0 < marks(tmp_path / "broken.zarr") < len(tiles(job))
    (tmp_path / "broken.zarr" / "kind" / "c" / "0.3f.partial").write_bytes(b"half a chunk")
    told = []
    resumed = make(job, store=tmp_path / "broken.zarr", progress=lambda done, before: told.append((done, before)))
    assert told[0][0] == told[0][1] > 0 and told[-1][0] == job.lanes
    xr.testing.assert_identical(resumed, whole)
    assert contents(tmp_path / "broken.zarr") == contents(tmp_path / "whole.zarr")


def test_a_tile_without_its_mark_is_made_again(tmp_path):
    """What a kill between the chunks and the mark leaves; and a chunk that is there but wrong must not be trusted."""
    job = peterka_job(lyapunov_cycles=0)
    make(job, store=tmp_path / "a.zarr")
    before = contents(tmp_path / "a.zarr")
    (tmp_path / "a.zarr" / "tile_done" / "c" / "1").unlink()
    chunk = tmp_path / "a.zarr" / "impact_force" / "c" / "1" / "0"
    chunk.write_bytes((tmp_path / "a.zarr" / "impact_force" / "c" / "0" / "0").read_bytes())
    make(job, store=tmp_path / "a.zarr")
    assert contents(tmp_path / "a.zarr") == before


def test_a_killed_process_leaves_a_store_that_is_resumed_to_the_same_bytes(tmp_path):
    """SIGKILL at a random moment of a process that stops before the last tile: however slow the machine is, the kill is never too late."""
    import multiprocessing

    job = peterka_job(1, lyapunov_cycles=0)
    make(job, store=tmp_path / "whole.zarr")
    process = multiprocessing.get_context("forkserver").Process(target=all_but_the_last, args=(job, tmp_path / "killed.zarr"), daemon=True)
    process.start()
    while marks(tmp_path / "killed.zarr") < 1:
        assert process.is_alive()
        time.sleep(0.02)
    moment = random.uniform(0.0, 0.3)
    time.sleep(moment)
    process.kill()
    process.join()
    assert 1 <= marks(tmp_path / "killed.zarr") < len(tiles(job))
    make(job, store=tmp_path / "killed.zarr")
    assert contents(tmp_path / "killed.zarr") == contents(tmp_path / "whole.zarr"), f"killed {moment} s after the first tile"


def all_but_the_last(job: Job, store) -> None:
    """For a process of its own, which then waits to be killed."""
    import jax

    jax.config.update("jax_enable_x64", True)
    last = job.lanes - job.size(tiles(job)[-1])
    make(job, store=store, progress=lambda done, before: signal.pause() if done == last else None)


@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize("job", [peterka_job(lyapunov_cycles=0), sweep_job()], ids=["map", "sweep"])
def test_a_cluster_writes_the_same_bytes(job, tmp_path):
    from dask.distributed import Client, LocalCluster

    make(job, store=tmp_path / "here.zarr")
    told = []
    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        Client(cluster, timeout=3600) as client,
    ):
        found = make(job, store=tmp_path / "there.zarr", client=client, progress=lambda done, before: told.append(done))
        check_same(found, make(job))
        with pytest.raises(InputError, match="a cluster is given without a store"):
            make(job, client=client)
    assert told[-1] == job.lanes
    assert contents(tmp_path / "there.zarr") == contents(tmp_path / "here.zarr")


def test_a_store_of_other_settings_is_refused_and_left_alone(tmp_path):
    store = tmp_path / "a.zarr"
    make(peterka_job(lyapunov_cycles=0), store=store)
    before = contents(store)
    other = peterka_job(lyapunov_cycles=0, span=Span(transient=25, recorded=8))
    with pytest.raises(InputError, match=r"begun with other settings: settings.span.transient is 24 in the store, 25 now; give the same"):
        make(other, store=store)
    draws = Draws(names=("k_i",), values=np.array([[1e6], [2e6]]), seed=0)
    with pytest.raises(InputError, match=r"study is \"peterka\" in the store, \"bifurcation\" now, and \d+ more"):
        make(sweep_job(draws=draws), store=store)
    assert contents(store) == before


def test_what_is_no_store_or_in_use_is_refused(tmp_path):
    job = peterka_job()
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="file cannot be opened"):
        make(job, store=tmp_path / "file")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="folder is not a store of a study, or is damaged"):
        make(job, store=tmp_path / "folder")
    lock = os.open(tmp_path / "folder", os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    with pytest.raises(InputError, match="folder is in use"):
        make(job, store=tmp_path / "folder")
    os.close(lock)
    with pytest.raises(InputError, match="no is not a folder"):
        make(peterka_job(lyapunov_cycles=0), store=tmp_path / "no" / "a.zarr")
    with pytest.raises(InputError, match="section is one operating point"):
        make(Job(study="section", model=model(), axes={}, settings={}), store=tmp_path / "a.zarr")
    with pytest.raises(InputError, match="0 operating points in a tile"):
        peterka_job(0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_tiles_cover_every_point_once():
    for job in (peterka_job(1), peterka_job(5), peterka_job(1000), sweep_job()):
        shape = tuple(len(values) for values in job.axes.values())
        seen = np.zeros(shape, dtype=int)
        for tile in tiles(job):
            seen[tuple(tile.parts.values())] += 1
            assert tile.after is None or tile.after < tile.number
        assert (seen == 1).all()


def flipped(file, place: int) -> None:
    """One bit of a file turned over."""
    content = bytearray(file.read_bytes())
    content[place % len(content)] ^= 1
    file.write_bytes(content)


def cut(file, place: int) -> None:
    """A file without its end."""
    file.write_bytes(file.read_bytes()[: place % file.stat().st_size])


def swapped(file, place: int) -> None:
    """A whole chunk, of another tile."""
    other = next(each for each in sorted(file.parents[1].rglob("*")) if each.is_file() and each.read_bytes() != file.read_bytes())
    file.write_bytes(other.read_bytes())


@pytest.mark.parametrize("array", ["impact_force", "tile_done"])
@pytest.mark.parametrize("damage", [flipped, cut, lambda file, place: file.unlink(), swapped], ids=["bit", "cut", "deleted", "swapped"])
def test_a_damaged_tile_is_named_and_made_again(damage, array, tmp_path):
    job, store, said = peterka_job(lyapunov_cycles=0), tmp_path / "a.zarr", []
    whole = make(job, store=store)
    before = contents(store)
    damage(next(path for path in sorted((store / array / "c").rglob("*")) if path.is_file()), 5)
    xr.testing.assert_identical(make(job, store=store, notice=said.append), whole)
    assert contents(store) == before
    if (array, damage.__name__) != ("tile_done", "<lambda>"):  # a tile without a mark is one that was never finished
        assert said == [f"{store}: tile 1 (clearance 0.2 to 0.2, ratio 1.4 to 3.2) is damaged; it is made again"]


@pytest.mark.parametrize("damage", [flipped, cut, lambda file, place: file.unlink()], ids=["bit", "cut", "deleted"])
@pytest.mark.parametrize("file", ["zarr.json", "impact_force/zarr.json", "ratio/zarr.json", "ratio/c/0"])
def test_a_store_whose_description_is_damaged_is_refused(file, damage, tmp_path):
    job, store = peterka_job(lyapunov_cycles=0), tmp_path / "a.zarr"
    make(job, store=store)
    for place in (11, 300):
        kept = (store / file).read_bytes()
        damage(store / file, place)
        before = contents(store)
        with pytest.raises(InputError, match=r"damaged|begun with other settings"):
            make(job, store=store)
        assert contents(store) == before
        (store / file).write_bytes(kept)


def test_other_programs_meet_the_checksum_of_a_chunk(tmp_path):
    make(peterka_job(lyapunov_cycles=0), store=tmp_path / "a.zarr")
    flipped(tmp_path / "a.zarr" / "impact_force" / "c" / "0" / "0", 5)
    with pytest.raises(ValueError, match="checksum"), xr.open_zarr(tmp_path / "a.zarr", consolidated=False) as data:
        data["impact_force"].load()


def test_a_store_that_another_run_made_first_is_in_use(tmp_path, monkeypatch):
    """Two first runs: the second finds the place taken when its own store is ready."""
    job, store = peterka_job(lyapunov_cycles=0), tmp_path / "a.zarr"
    locks = []

    def taken_first(*names):
        store.mkdir()
        (store / "zarr.json").write_text("{}")
        locks.append(os.open(store, os.O_RDONLY))
        fcntl.flock(locks[0], fcntl.LOCK_EX)
        monkeypatch.undo()
        os.rename(*names)

    monkeypatch.setattr("vibrojax.studies.store.os.rename", taken_first)
    with pytest.raises(InputError, match="a.zarr is in use"):
        make(job, store=store)
    os.close(locks[0])
