"""`python -m benchmarks.coverage --experiments 50 --json FILE`: fit experiments of the independent simulator and count.

Each trial is one line of `FILE` with the suffix .jsonl, written as soon as it is done; with --resume those already there are kept, except
for failures.
"""

import argparse
import json
from pathlib import Path

from rich.console import Console

from benchmarks.coverage.summary import summary, table
from benchmarks.coverage.trial import trial
from benchmarks.machine import machine
from benchmarks.resumable import finished, lines_beside, run_trials


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coverage", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--experiments", type=int, default=50, metavar="N", help="how many, soft and stiff rigs in turn")
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--resume", action="store_true", help="keep the trials that an earlier run has finished without failure")
    options = parser.parse_args()
    lines = lines_beside(options.json, resume=options.resume)
    done = finished(lines, "index")
    wanted = [index for index in range(options.experiments) if index not in done or "failure" in done[index]]
    run_trials("experiments", trial, wanted, lines, workers=options.workers)
    trials = finished(lines, "index")
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


if __name__ == "__main__":
    main()
