"""`python -m benchmarks.posterior [FOLDERS] --json FILE`: 95 % intervals by NUTS, standard errors and profile likelihood side by side.

Each experiment is one line of `FILE` with the suffix .jsonl, written as soon as it is done; with --resume those already there are kept,
except for failures.
"""

import argparse
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from benchmarks.posterior.curved import NAME
from benchmarks.posterior.trial import Job, trial
from benchmarks.resumable import finished, lines_beside, run_trials

NAMES = ("k_i", "n", "lambda_i", "zeta", "f_n")


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    lines = lines_beside(options.json, resume=options.resume)
    wanted = jobs(options.folders, options.draws, options.curved_draws)
    done = finished(lines, "name")
    run_trials("experiments", trial, [job for job in wanted if "parameters" not in done.get(job.name, {})], lines, workers=1)
    known = finished(lines, "name")
    rows = [known[job.name] for job in wanted]
    show(rows)
    options.json.write_text(json.dumps({"machine": machine(), "trials": rows}, indent=1) + "\n", encoding="utf-8")


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.posterior", description=(__doc__ or "").splitlines()[0].split(": ", 1)[1])
    made.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help=f"experiments, beside the simulated one, {NAME!r}")
    made.add_argument("--draws", type=int, default=400, metavar="N", help="of each of four chains")
    made.add_argument("--curved-draws", type=int, default=1000, metavar="N", help="the same of the simulated experiment, which is small")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--resume", action="store_true", help="keep the experiments that an earlier run has finished without failure")
    return made


def jobs(folders: list[Path], draws: int, curved_draws: int) -> list[Job]:
    """The simulated experiment and those of the folders, named by the last two parts of their paths."""
    given = [Job(name="/".join(folder.resolve().parts[-2:]), folder=folder.resolve(), draws=draws) for folder in folders]
    return [Job(name=NAME, folder=None, draws=curved_draws), *given]


def show(rows: list[dict]) -> None:
    """Print one line for each experiment: its intervals in standard errors from the estimate, and the diagnostics of the sampler."""
    table = Table("experiment", "by", *NAMES, "minutes", "R-hat", "ESS", "diverged", "warnings")
    for row in rows:
        if "failure" in row:
            table.add_row(row["name"], row["failure"])
            continue
        figures = [f"{row['minutes']:.1f}", f"{row['rhat']:.3f}", f"{row['ess']:.0f}", str(row["divergent"]), str(len(row["warnings"]))]
        found = [row["parameters"].get(name) for name in NAMES]
        table.add_row(row["name"], "NUTS", *(ends(one and one["nuts"]) for one in found), *figures)
        table.add_row("", "profile", *(ends(one and one["profile"]) for one in found), end_section=True)
    console = Console()
    console.print(table)
    console.print("95 % intervals in standard errors from the estimate, logarithms of all but n; that of the standard errors: -1.96 … 1.96")


def ends(interval: list[float | None] | None) -> str:
    """An interval in words."""
    if interval is None:
        return "-"
    return " … ".join("open" if end is None else f"{end:+.2f}" for end in interval)


if __name__ == "__main__":
    main()
