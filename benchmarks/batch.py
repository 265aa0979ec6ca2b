"""`python -m benchmarks.batch --json FILE`: what a batch of small drop tests costs an experiment, and whether killed ones end alike.

The experiments are simulated, each with a rig and noise of its own. One run for each number of workers; then one that is killed (SIGKILL)
again and again, at moments drawn uniformly from what an undisturbed run would take, and resumed. Tables are compared but for the seconds.
"""

import argparse
import csv
import json
import random
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.machine import machine
from benchmarks.sizes import Records, write

_COMMAND = "from vibrojax.cli.fit import main; main()"
_DROP = Records(drops=1, driven=0, seconds=0.5, rate_hz=4e3)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.batch", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--count", type=int, default=100, help="experiments")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="numbers of processes; the last is that of the killed run")
    parser.add_argument("--kills", type=int, default=10, help="how often")
    parser.add_argument("--seed", type=int, default=0, help="of rigs, noise and moments")
    options = parser.parse_args()
    console, found = Console(), {"experiments": options.count, "seconds": {}, "machine": machine()}
    with tempfile.TemporaryDirectory(prefix="batch-") as name:
        folder, rng = Path(name), random.Random(options.seed)
        for number in range(options.count):
            rig = np.random.default_rng([options.seed, number])
            write(folder / "rigs" / f"day{number // 20 + 1}" / f"drop-{number:03d}", (_DROP,), rig)
        for workers in options.workers:
            begin, out = time.perf_counter(), folder / f"whole{workers}"
            _started(folder, out, workers).wait()
            seconds = time.perf_counter() - begin
            found["seconds"][workers] = {"all": seconds, "each": seconds / options.count}
            console.print(f"{workers} workers: {seconds:.0f} s, {seconds / options.count:.2f} s an experiment")
        found["same_with_other_workers"] = all(_table(folder / f"whole{w}") == _table(out) for w in options.workers)
        again = folder / "killed"
        for number in range(options.kills):
            process = _started(folder, again, workers)
            with suppress(subprocess.TimeoutExpired):
                process.wait(rng.uniform(0.0, 2.0 * seconds / (options.kills + 1)))
            process.kill()
            process.wait()
            state = again / "batch.json"
            done = len(json.loads(state.read_text(encoding="utf-8"))["rows"]) if state.exists() else 0
            console.print(f"kill {number + 1}: {done} of {options.count} fitted")
        _started(folder, again, workers).wait()
        found["kills"], found["same_after_kills"] = options.kills, _table(again) == _table(out)
    options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    console.print({key: value for key, value in found.items() if key != "machine"})


def _started(folder: Path, out: Path, workers: int) -> subprocess.Popen:
    arguments = ["--batch", str(folder / "rigs"), "--out", str(out), "--workers", str(workers), "--quiet"]
    return subprocess.Popen([sys.executable, "-c", _COMMAND, *arguments], stderr=subprocess.DEVNULL)


def _table(out: Path) -> list[dict[str, str]]:
    with (out / "batch.csv").open(encoding="utf-8", newline="") as file:
        return [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(file)]


if __name__ == "__main__":
    main()
