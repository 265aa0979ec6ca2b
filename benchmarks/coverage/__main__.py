"""`python -m benchmarks.coverage --rigs quiet force colour both --count 50 --json FILE`: fit simulated experiments and count.

Rigs are quiet, pushed by a random force, have coloured sensor noise, or both. Each trial is one line of `FILE` with the suffix .jsonl,
written as soon as it is done; with --resume those already there are kept, except for failures.
"""

import argparse
import json
from pathlib import Path

from rich.console import Console

from benchmarks.coverage.summary import summary, table
from benchmarks.coverage.trial import RIGS, Experiment, trial
from benchmarks.machine import machine
from benchmarks.resumable import finished, lines_beside, run_trials


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    lines = lines_beside(options.json, resume=options.resume)
    done = finished(lines, "key")
    rigs = list(dict.fromkeys(options.rigs))
    wanted = {rig: [Experiment(rig=rig, seed=options.seed, index=index) for index in range(options.count)] for rig in rigs}
    left = [one for ones in wanted.values() for one in ones if one.key not in done or "failure" in done[one.key]]
    run_trials("experiments", trial, left, lines, workers=options.workers)
    trials = finished(lines, "key")
    results = {rig: summary([trials[one.key] for one in ones]) for rig, ones in wanted.items()}
    document = {"machine": machine(), "seed": options.seed, "rigs": results}
    options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    for rig, result in results.items():
        show(rig, result)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.coverage", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--rigs", nargs="+", choices=list(RIGS), default=["quiet"], help="which rigs")
    made.add_argument("--count", type=int, default=50, metavar="N", help="experiments with each, soft and stiff rigs in turn")
    made.add_argument("--seed", type=int, default=0, help="of the experiments")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--workers", type=int, default=1, help="processes")
    made.add_argument("--resume", action="store_true", help="keep the trials that an earlier run has finished without failure")
    return made


def show(rig: str, result: dict) -> None:
    """Print the figures of one kind of rig."""
    console = Console()
    console.print(table(rig, result))
    chi2, count = result["chi2_reduced"], len(result["failures"])
    console.print(
        f"reduced chi-square {chi2['least']} … {chi2['largest']}; not converged: {len(result['not_converged'])}; failures: {count}"
    )
    for key, failure in result["failures"].items():
        console.print(f"  {key}: {failure}", markup=False)


if __name__ == "__main__":
    main()
