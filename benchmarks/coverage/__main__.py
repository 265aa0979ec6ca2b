"""`python -m benchmarks.coverage --experiments 50 --json FILE`: fit experiments of the independent simulator and count.

Each trial is one line of `FILE` with the suffix .jsonl, written as soon as it is done; with --resume those already there are kept.
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.coverage.summary import summary, table
from benchmarks.coverage.trial import trial
from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coverage", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--experiments", type=int, default=50, metavar="N", help="how many, soft and stiff rigs in turn")
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--resume", action="store_true", help="keep the trials that an earlier run has finished")
    options = parser.parse_args()
    lines = options.json.with_suffix(".jsonl")
    if not options.resume:
        lines.unlink(missing_ok=True)
    done = finished(lines)
    run([index for index in range(options.experiments) if index not in done], lines, workers=options.workers)
    trials = finished(lines)
    result = summary([trials[index] for index in sorted(trials) if index < options.experiments])
    options.json.write_text(json.dumps({"machine": machine()} | result, indent=1) + "\n", encoding="utf-8")
    console = Console()
    console.print(table(result))
    chi2, count = result["chi2_reduced"], len(result["failures"])
    console.print(
        f"reduced chi-square {chi2['least']} … {chi2['largest']}; not converged: {len(result['not_converged'])}; failures: {count}"
    )
    for index, failure in result["failures"].items():
        console.print(f"  {index}: {failure}", markup=False)


def finished(lines: Path) -> dict[int, dict]:
    """Trials by index; a last line that an interruption cut off does not count."""
    found = {}
    for line in lines.read_text(encoding="utf-8").splitlines() if lines.exists() else []:
        try:
            one = json.loads(line)
        except ValueError:
            continue
        found[one["index"]] = one
    return found


def run(indices: list[int], lines: Path, *, workers: int) -> None:
    """Run the trials and append each to the file as it ends."""
    bar = Progress(TextColumn("experiments"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    context = get_context("spawn")
    with bar, ProcessPoolExecutor(workers, mp_context=context, initializer=prepare_jax) as pool, lines.open("a", encoding="utf-8") as file:
        task = bar.add_task("", total=len(indices))
        if lines.stat().st_size and not lines.read_bytes().endswith(b"\n"):
            file.write("\n")
        for future in as_completed([pool.submit(trial, index) for index in indices]):
            file.write(json.dumps(future.result()) + "\n")
            file.flush()
            bar.advance(task)


if __name__ == "__main__":
    main()
