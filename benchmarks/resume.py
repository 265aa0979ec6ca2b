"""`python -m benchmarks.resume --kills 20`: studies killed at random moments and resumed end with the bytes of undisturbed ones.

Each kill has a new store: a process makes a study into it and is killed (SIGKILL) at a moment drawn uniformly between the first trace of
the store on the disk and the end of an undisturbed run; another process then finishes the store, and every file of it is compared with
the undisturbed store's. A Peterka map, basins, a bifurcation sweep and a frequency response over draws take turns.
"""

import argparse
import json
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

_PRELOADED = ["vibrojax.studies.run", "dask.array", "zarr"]


def jobs() -> dict[str, Any]:
    """Small studies of many tiles."""
    import numpy as np

    from vibrojax.batch import Span
    from vibrojax.contact import HuntCrossley
    from vibrojax.model import Model
    from vibrojax.studies.draws import Draws
    from vibrojax.studies.job import Job
    from vibrojax.suspension import Linear

    model = Model(mass=0.5, suspension=Linear(0.02, 4.0), law=HuntCrossley(1e6, 1.5, 0.3))
    short: dict[str, Any] = {"base_amplitude": 2e-3, "span": Span(transient=64)}
    point = {"frequency_hz": 7.0, "gap": 4e-3}
    plane = {"clearance": np.linspace(0.0, 3.0, 24), "ratio": np.linspace(0.5, 5.0, 24)}
    starts = {"v0": np.linspace(-0.3, 0.3, 24), "u0": np.linspace(-2e-3, 2e-3, 24)}
    draws = Draws(names=("k_i", "zeta"), values=np.random.default_rng(1).normal([1e6, 0.02], [1e5, 1e-3], size=(12, 2)), seed=1)
    line = {"gap": [1e-3], "frequency_hz": np.linspace(3.0, 9.0, 64)}
    return {
        "peterka": Job(study="peterka", model=model, axes=plane, settings=short | {"lyapunov_cycles": 20}, points=24),
        "basins": Job(study="basins", model=model, axes=starts, settings=short | point, points=24),
        "bifurcation": Job(
            study="bifurcation",
            model=model,
            axes={"values": np.linspace(2e-3, 8e-3, 24)},
            settings=short | {"parameter": "gap", "frequency_hz": 7.0},
            points=2,
        ),
        "response, 12 draws": Job(study="response", model=model, axes=line, settings=short, draws=draws, points=32),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.resume", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--kills", type=int, default=20, help="how often")
    parser.add_argument("--seed", type=int, default=None, help="of the moments; left out: another every time")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    console, rng = Console(), random.Random(options.seed)
    with tempfile.TemporaryDirectory(prefix="resume-") as folder:
        rows = list(_rows(options.kills, rng, Path(folder), console))
    same = sum(row["same_bytes"] for row in rows)
    midway = sum(0 < row["tiles_done"] < row["tiles"] for row in rows)
    console.print(f"{same} of {len(rows)} resumed stores have the bytes of the undisturbed ones; {midway} were killed between two tiles")
    if options.json is not None:
        options.json.write_text(json.dumps({"kills": rows, "same_bytes": same, "machine": machine()}, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if same == len(rows) else 1)


def _rows(kills: int, rng: random.Random, folder: Path, console: Console):
    """One kill after the other, with what came of it."""
    prepare_jax()
    all_jobs = jobs()
    wholes: dict[str, tuple[dict[str, bytes], float]] = {}
    for number in range(kills):
        name = list(all_jobs)[number % len(all_jobs)]
        job, store = all_jobs[name], folder / f"{number}.zarr"
        if name not in wholes:
            undisturbed(job, folder / "warm.zarr")  # compiles, so that moments are drawn from a run that mostly computes
            shutil.rmtree(folder / "warm.zarr")
            seconds = undisturbed(job, folder / f"{name}.zarr")
            wholes[name] = contents(folder / f"{name}.zarr"), seconds
        whole, seconds = wholes[name]
        moment = rng.uniform(0.0, seconds)
        done, of = killed(job, store, moment)
        undisturbed(job, store)
        row = {"study": name, "killed_after_s": round(moment, 3), "of_s": round(seconds, 3), "tiles_done": done, "tiles": of}
        row["same_bytes"] = contents(store) == whole
        console.print(row)
        yield row
        shutil.rmtree(store)


def undisturbed(job: Any, store: Path) -> float:
    """Make a study, or what is left of it, in a process of its own; its seconds from the first trace of the store on."""
    process = _started(job, store)
    begin = _begun(process, store)
    process.join()
    if process.exitcode != 0:
        raise RuntimeError(f"the study ended with exit status {process.exitcode}")
    return time.perf_counter() - begin


def killed(job: Any, store: Path, after: float) -> tuple[int, int]:
    """Begin a study and kill it so many seconds after the first trace of its store: how many tiles were done by then, and of how many."""
    from vibrojax.studies.job import tiles

    process = _started(job, store)
    _begun(process, store)
    process.join(after)
    process.kill()
    process.join()
    return marks(store), len(tiles(job))


def _begun(process: Any, store: Path) -> float:
    """When there is something on the disk: the store, or the folder in which it is made."""
    while process.is_alive() and not (store.exists() or list(store.parent.glob(f".{store.name}-unfinished-*"))):
        time.sleep(0.002)
    return time.perf_counter()


def marks(store: Path) -> int:
    """Tiles that are marked as done; each mark is a file."""
    return sum(path.is_file() and not path.name.endswith(".partial") for path in store.glob("tile_done/c/*"))


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(path.relative_to(store)): path.read_bytes() for path in sorted(store.rglob("*")) if path.is_file()}


def _started(job: Any, store: Path) -> Any:
    """A process that makes the study; a server that has imported everything forks it."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    process = context.Process(target=work, args=(job, store))
    process.start()
    return process


def work(job: Any, store: Path) -> None:
    """What such a process does."""
    prepare_jax()
    from vibrojax.studies.run import make

    make(job, store=store)


if __name__ == "__main__":
    main()
