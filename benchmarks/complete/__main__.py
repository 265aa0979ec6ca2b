"""`python -m benchmarks.complete --count N --seed S --json FILE`: fit complete models to awkward records and count what is right.

The carts of some records were not recorded, first impacts are weak, the records' rates differ, and there is no load cell. Each trial is one
line of `FILE` with the suffix .jsonl, written as soon as it is done; with --resume those already there are kept, except for failures.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.complete.rigs import Job
from benchmarks.complete.trial import trial
from benchmarks.machine import machine
from benchmarks.resumable import finished, lines_beside, run_trials


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    lines = lines_beside(options.json, resume=options.resume)
    done = finished(lines, "key")
    wanted = [Job(seed=options.seed, index=index) for index in range(options.count)]
    run_trials("experiments", trial, [job for job in wanted if "rows" not in done.get(job.key, {})], lines, workers=options.workers)
    known = finished(lines, "key")
    rows = [known[job.key] for job in wanted]
    right = sum(row["right"] for row in rows)
    show(rows)
    document = {"machine": machine(), "seed": options.seed, "right": right, "of": len(rows), "trials": rows}
    options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.complete", description=(__doc__ or "").splitlines()[0].split(": ", 1)[1])
    made.add_argument("--count", type=int, default=40, metavar="N", help="experiments, soft and stiff rigs in turn")
    made.add_argument("--seed", type=int, default=0, help="of the experiments")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--workers", type=int, default=1, help="processes")
    made.add_argument("--resume", action="store_true", help="keep the trials that an earlier run has finished without failure")
    return made


def show(rows: list[dict]) -> None:
    """Print one line for each experiment, and the count of right ones."""
    table = Table("experiment", "unseen carts", "accelerometer", "chi-square", "farthest parameter", "right", "s")
    for row in rows:
        shown = [row["failure"], ""] if "failure" in row else [f"{row['chi2_reduced']:.3f}", farthest(row)]
        table.add_row(
            row["key"],
            str(len(row["unseen"])),
            "yes" if row["accelerometer"] else "no",
            *shown,
            "yes" if row["right"] else "NO",
            f"{row['seconds']:.0f}",
        )
    console = Console()
    console.print(table)
    console.print(f"right: {sum(row['right'] for row in rows)} of {len(rows)}; median {np.median([row['seconds'] for row in rows]):.0f} s")


def farthest(row: dict) -> str:
    """The parameter farthest from its truth, with the distance in standard errors; or one that has none."""
    shared = [one for one in row["rows"] if "record" not in one]
    if lost := [one["name"] for one in shared if one["z"] is None]:
        return f"{lost[0]} without an error"
    worst = max(shared, key=lambda one: abs(one["z"]))
    return f"{worst['name']} {worst['z']:+.1f}"


if __name__ == "__main__":
    main()
