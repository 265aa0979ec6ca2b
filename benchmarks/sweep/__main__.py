"""`python -m benchmarks.sweep --json FILE`: 1000 frequencies x 100 cycles, ours beside the peers, at equal error of section points.

Error: distance of the last section point from the reference, over the base amplitude, median of the lanes whose orbit has closed. Ours is
timed without early stop: all engines integrate every cycle. The ratio at the stated error is read off the work-precision line of each
engine, at the same median error.
"""

import argparse
import dataclasses
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

STATED_ERROR = 1e-5
PEERS = ("numba", "diffrax_vmap", "scipy_lsoda", "scipy_dop853")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sweep", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="work-precision plot")
    parser.add_argument("--lanes", type=int, default=1000, help="frequencies")
    parser.add_argument("--cycles", type=int, default=100, help="a multiple of ten")
    parser.add_argument("--repeats", type=int, default=5, help="timings of which the best counts")
    parser.add_argument(
        "--scipy-lanes", type=int, default=20, help="lanes, of those whose orbit has closed, that SciPy's solvers are timed on"
    )
    parser.add_argument(
        "--problems", nargs="*", choices=("soft", "stiff"), default=["soft", "stiff"], help="the first one's figures come first"
    )
    options = parser.parse_args()
    prepare_jax()
    console = Console(width=110)
    found = {name: measure(name, options, console) for name in options.problems}
    first = found[options.problems[0]]
    report = first | {"problems": found, "machine": machine()}
    options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if options.plot is not None:
        from benchmarks.sweep.plot import work_precision

        work_precision(found, STATED_ERROR, options.plot)


def measure(name: str, options: argparse.Namespace, console: Console) -> dict:
    """One problem: every run, and what follows at the stated error."""
    from benchmarks.sweep.contact_step import contact_cost
    from benchmarks.sweep.engines import check, reference, runs, seconds_at
    from benchmarks.sweep.problem import PROBLEMS

    problem = dataclasses.replace(PROBLEMS[name], lanes=options.lanes, cycles=options.cycles)
    with console.status(f"{name}: the reference"):
        truth = reference(problem)
        if not truth.periodic.any():
            raise SystemExit(f"{name}: none of {problem.lanes} orbits has closed, so that no error is known: ask for more lanes or cycles")
        distance = check(problem, truth, 5)
    table = Table(
        "engine", "setting", "error, median", "error, 90 %", "seconds", title=f"{name}: {problem.lanes} x {problem.cycles} cycles"
    )
    all_runs = []
    for run in runs(problem, truth, repeats=options.repeats, scipy_lanes=options.scipy_lanes):
        all_runs.append(run)
        table.add_row(run.engine, f"{run.setting:g}", f"{run.miss['median']:.1e}", f"{run.miss['quantile90']:.1e}", f"{run.seconds:.3f}")
    console.print(table)
    seconds = {engine: seconds_at(all_runs, engine, STATED_ERROR) for engine in ("ours", *PEERS)}
    ours = seconds["ours"]
    ratio = {peer: _ratio(seconds[peer], ours) for peer in PEERS}
    console.print(
        f"at a median error of {STATED_ERROR:g}: " + ", ".join(f"{peer} / ours {_number(value)}" for peer, value in ratio.items())
    )
    step = contact_cost(problem)
    console.print(
        f"a contact step: {step['nanoseconds']:.0f} ns, {step['operations']:.0f} operations, {step['exponentials_and_roots']:.0f} "
        f"exponentials and roots, {1e-9 * step['operations_per_second']:.1f} thousand million operations a second; bare arithmetic reaches "
        f"{1e-9 * step['bare_operations_per_second']:.1f}"
    )
    return {
        "contact_step": step,
        "problem": dataclasses.asdict(problem) | {"periodic_lanes": int(truth.periodic.sum())},
        "reference_distance_from_dop853": distance,
        "error": {engine: STATED_ERROR if value else None for engine, value in seconds.items()},
        "seconds": seconds,
        "ratio": ratio,
        "runs": [dataclasses.asdict(run) for run in all_runs],
    }


def _ratio(theirs: float | None, ours: float | None) -> float | None:
    return None if theirs is None or ours is None else theirs / ours


def _number(value: float | None) -> str:
    return "not reached" if value is None else f"{value:.1f}"


if __name__ == "__main__":
    main()
