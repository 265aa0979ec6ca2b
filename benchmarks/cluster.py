"""`python -m benchmarks.cluster --json FILE`: a Peterka map on Dask clusters of one and of two workers, one thread each.

Every worker first makes the map once, so that its programs are compiled; then the map is made anew, `--repeats` times, and the best counts.
Also checked: the stores of both clusters and the one made without a cluster hold the same bytes.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cluster", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    parser.add_argument("--side", type=int, default=64, help="points a side of the map")
    parser.add_argument("--tile", type=int, default=256, help="points in a tile")
    parser.add_argument("--cycles", type=int, default=300, help="transient cycles")
    parser.add_argument("--repeats", type=int, default=3, help="timings of which the best counts")
    options = parser.parse_args()
    prepare_jax()
    console = Console()
    with tempfile.TemporaryDirectory(prefix="cluster-") as folder:
        report = measure(options, Path(folder), console)
    console.print(report)
    if options.json is not None:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if report["same_bytes"] else 1)


def measure(options: argparse.Namespace, folder: Path, console: Console) -> dict:
    """Seconds of each cluster, and whether all stores are the same."""
    import numpy as np
    from dask.distributed import LocalCluster

    from benchmarks.resume import contents
    from vibrojax.batch import Span
    from vibrojax.cli.environment import connected
    from vibrojax.contact import HuntCrossley
    from vibrojax.model import Model
    from vibrojax.studies.job import Job, tiles
    from vibrojax.studies.run import make
    from vibrojax.suspension import Linear

    model = Model(mass=0.5, suspension=Linear(0.02, 4.0), law=HuntCrossley(1e6, 1.5, 0.3))
    plane = {"clearance": np.linspace(0.0, 3.0, options.side), "ratio": np.linspace(0.5, 5.0, options.side)}
    settings = {"base_amplitude": 2e-3, "span": Span(transient=options.cycles)}
    job = Job(study="peterka", model=model, axes=plane, settings=settings, points=options.tile)
    make(job, store=folder / "here.zarr")
    whole, seconds, same = contents(folder / "here.zarr"), {}, True
    for workers in (1, 2):
        times = []
        silent: Any = {"dashboard_address": None}
        cluster: Any = LocalCluster(n_workers=workers, threads_per_worker=1, **silent)
        with cluster:
            with connected(cluster.scheduler_address) as client:
                client.wait_for_workers(workers)
                for number in range(options.repeats + 1):
                    store, begin = folder / f"{workers}-{number}.zarr", time.perf_counter()
                    make(job, store=store, client=client)
                    times.append(time.perf_counter() - begin)
                    same = same and contents(store) == whole
        seconds[str(workers)] = min(times[1:])
        console.print(f"{workers} workers: {', '.join(f'{each:.2f}' for each in times)} s, the first with compiling")
    return {
        "points": job.lanes,
        "tiles": len(tiles(job)),
        "seconds": seconds,
        "speed_up": seconds["1"] / seconds["2"],
        "same_bytes": same,
        "machine": machine(),
    }


if __name__ == "__main__":
    main()
