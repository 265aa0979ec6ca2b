"""`python -m benchmarks.posterior [FOLDERS] --json FILE`: 95 % intervals by weighted draws, errors and profiles side by side.

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
from benchmarks.posterior.trial import NORMAL, Job, trial
from benchmarks.resumable import finished, lines_beside, run_trials

NORMAL_ENDS = f"-{NORMAL} +{NORMAL}"
"""The interval of the standard error."""
INTERVALS = ("profile", "area", "draws")


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
    made.add_argument("--draws", type=int, default=400, metavar="N", help="weighted, of the posterior")
    made.add_argument("--curved-draws", type=int, default=2000, metavar="N", help="the same of the simulated experiment, which is small")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--resume", action="store_true", help="keep the experiments that an earlier run has finished without failure")
    return made


def jobs(folders: list[Path], draws: int, curved_draws: int) -> list[Job]:
    """The simulated experiment and those of the folders, named by the last two parts of their paths."""
    given = [Job(name="/".join(folder.resolve().parts[-2:]), folder=folder.resolve(), draws=draws) for folder in folders]
    return [Job(name=NAME, folder=None, draws=curved_draws), *given]


def show(rows: list[dict]) -> None:
    """Print the intervals of every parameter side by side, and how good every sample is."""
    console = Console()
    console.print(intervals(rows))
    console.print("Ends of 95 % intervals from the estimate, in standard errors; logarithms of all parameters but n.")
    console.print("Area: the middle 95 % under the profile likelihood, in the same coordinates, in which the prior of the draws is flat.")
    console.print(diagnostics(rows))


def intervals(rows: list[dict]) -> Table:
    """One line for each parameter of each experiment."""
    table = Table("experiment", "parameter", "value", "standard error", "Laplace", "profile", "its area", "draws")
    for row in rows:
        title = row["name"]
        for name, one in row.get("parameters", {}).items():
            shown = [f"{one['value']:.5g}", f"{one['stderr']:.2g}", NORMAL_ENDS, *(ends(one[by]) for by in INTERVALS)] if one else ["-"]
            table.add_row(title, name, *shown)
            title = ""
        table.add_section()
    return table


def diagnostics(rows: list[dict]) -> Table:
    """One line for each experiment."""
    table = Table("experiment", "draws", "worth", "tail of the weights", "minutes", "processor")
    for row in rows:
        if "failure" in row:
            table.add_row(row["name"], row["failure"])
            continue
        table.add_row(
            row["name"],
            str(row["draws"]),
            f"{row['effective']:.0f}",
            f"{row['tail']:.2f}",
            f"{row['minutes']:.1f}",
            f"{row['processor_minutes']:.1f}",
        )
    return table


def ends(interval: list[float | None]) -> str:
    """Both ends of an interval; a profile that does not rise far enough is open."""
    return " ".join("open" if end is None else f"{end:+.2f}" for end in interval)


if __name__ == "__main__":
    main()
