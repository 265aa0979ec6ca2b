"""`python -m benchmarks.contact_free --count K --seed S --json FILE`: conceal effects in rigs without a stop and count what is found."""

import argparse
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.contact_free.rigs import CONCEALED, Job
from benchmarks.contact_free.trial import trial
from benchmarks.machine import machine
from benchmarks.resumable import finished, lines_beside, run_trials


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    lines = lines_beside(options.json, resume=options.resume)
    done = finished(lines, "key")
    wanted = [
        Job(kind=kind, effect=effect, seed=options.seed, index=index)
        for kind, effects in CONCEALED.items()
        if kind in options.kinds
        for effect in (None, *effects)
        for index in range(options.count)
    ]
    run_trials("rigs", trial, [job for job in wanted if "verdict" not in done.get(job.key, {})], lines, workers=options.workers)
    known = finished(lines, "key")
    rows = [known[job.key] for job in wanted]
    show(rows)
    options.json.write_text(json.dumps({"machine": machine(), "seed": options.seed, "rigs": rows}, indent=1) + "\n", encoding="utf-8")


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.contact_free", description=(__doc__ or "").split(": ", 1)[1])
    made.add_argument("--kinds", nargs="+", choices=list(CONCEALED), default=list(CONCEALED), help="of rigs, or of their sensors")
    made.add_argument("--count", type=int, default=3, metavar="K", help="rigs of each kind and effect, and complete ones of each kind")
    made.add_argument("--seed", type=int, default=0, help="of the rigs")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--workers", type=int, default=1, help="processes")
    made.add_argument("--resume", action="store_true", help="keep the rigs that an earlier run has finished without failure")
    return made


def show(rows: list[dict]) -> None:
    """Print the counts, and every rig that the diagnosis is not right on."""
    table = Table("rig", "concealed", "rigs", "right", "or its twin", "wrong names", "s")
    for kind, effect in dict.fromkeys((row["kind"], row["effect"]) for row in rows):
        mine = [row for row in rows if (row["kind"], row["effect"]) == (kind, effect)]
        seconds = max(row.get("seconds", 0.0) for row in mine)
        counts = [str(sum(bool(row.get(what)) for row in mine)) for what in ("right", "or_twin", "wrong")]
        table.add_row(kind, effect or "nothing", str(len(mine)), *counts, f"{seconds:.0f} at most")
    console = Console()
    console.print(table)
    for row in rows:
        if not row.get("right"):
            said = row.get("failure") or f"{row['verdict']} {', '.join(row['named'])}; wrong: {', '.join(row['wrong']) or 'none'}"
            console.print(f"{row['key']}: {said}", markup=False)


if __name__ == "__main__":
    main()
