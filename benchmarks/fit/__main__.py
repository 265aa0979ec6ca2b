"""`python -m benchmarks.fit --json FILE`: our whole fit beside SciPy's, at equal accuracy, and the whole command cold and warm.

Both fit the same windows of the same experiment (the embedded example unless another is named) from the same start with the same
residuals. SciPy is called in three ways: as documented (dense two-point differences), by MINPACK, and with `jac_sparsity`, which lets it
difference many window states at once; always with `x_scale="jac"`, without which it fares worse.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

SUBSTEPS = 2
"""Contact steps of the peer in one sample: its error is then the nearest to ours from below."""
EQUAL = 0.1
"""Ends count as the same when no parameter differs by more than this many standard errors."""
CHANNEL_ERRORS = {"rms": lambda e: float(np.sqrt(np.mean(e**2))), "largest": lambda e: float(np.max(np.abs(e)))}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fit", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--experiment", type=Path, help="folder of another experiment than the embedded example")
    parser.add_argument("--repeats", type=int, default=3, help="timings of which the best counts")
    parser.add_argument("--skip", choices=("command", "peer"), nargs="*", default=[], help="parts to leave out")
    options = parser.parse_args()
    prepare_jax()
    console = Console()
    result = {"machine": machine()}
    if "command" not in options.skip:
        result |= _command(options.experiment, options.repeats, console)
    result |= _compare(options, console)
    options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def _command(experiment: Path | None, repeats: int, console: Console) -> dict:
    from benchmarks.fit.command import cold_and_warm

    with console.status("fit-parameters in fresh processes"):
        cold, warm = cold_and_warm(experiment, repeats=repeats)
    table = Table("fit-parameters", "wall time, s", "peak memory, MB", title="The whole command in a fresh process")
    table.add_row("empty compilation cache", f"{cold.seconds:.1f}", f"{cold.peak_mb:.0f}")
    table.add_row("warm compilation cache", f"{warm.seconds:.1f}", f"{warm.peak_mb:.0f}")
    console.print(table)
    return {
        "seconds": {"cold": cold.seconds, "warm": warm.seconds},
        "peak_mb": max(cold.peak_mb, warm.peak_mb),
        "peak_mb_by_run": {"cold": cold.peak_mb, "warm": warm.peak_mb},
    }


def _compare(options: argparse.Namespace, console: Console) -> dict:
    from benchmarks.fit.ours import jacobian_cost, our_fit, our_residuals
    from benchmarks.fit.peer import Problem
    from benchmarks.fit.reference import reference_residuals
    from identification.experiment import load_experiment
    from identification.prepare import prepare
    from vibrojax.data_files import data_path

    prepared = prepare(load_experiment(options.experiment or data_path("example")))
    with console.status("our fit"):
        ours = our_fit(prepared, repeats=options.repeats)
        simulation, jacobian = jacobian_cost(prepared, ours.outcome.estimate, repeats=5 * options.repeats)
    best = ours.outcome.estimate
    problem = Problem(prepared, substeps=SUBSTEPS)
    with console.status("errors of both simulators against DOP853"):
        exact = reference_residuals(prepared, best)
        error = {"ours": our_residuals(prepared, best) - exact, "peer": problem.data_residuals(best) - exact}
    errors = {who: {name: norm(values) for name, norm in CHANNEL_ERRORS.items()} for who, values in error.items()}
    result = {
        "problem": {"records": len(prepared.experiment.records), "windows": len(prepared.record), **problem.size(best)},
        "simulation_error_in_sigma": errors,
        "jacobian_cost": jacobian / simulation,
        "jacobian": {"simulation_seconds": simulation, "value_and_jacobian_seconds": jacobian, "columns": prepared.layout.shared},
        "ours": {"fit_seconds": ours.seconds, "first_fit_seconds": ours.first_seconds, "cost": ours.outcome.cost},
    }
    console.print(_error_table(errors))
    console.print(
        f"value and Jacobian in {prepared.layout.shared} parameters: {jacobian / simulation:.1f} simulations ({simulation * 1e3:.1f} ms)"
    )
    if "peer" in options.skip:
        return result
    return result | _peers(problem, prepared.start, ours, console)


def _peers(problem, start, ours, console: Console) -> dict:
    from benchmarks.fit.peer import VARIANTS, peer_fit

    table = Table("fit", "s", "times ours", "half chi-square", "farthest parameter, σ", "Jacobians", title="The whole fit, compiled before")
    table.add_row("ours", f"{ours.seconds:.2f}", "1", f"{ours.outcome.cost:.2f}", "0", "")
    found = {}
    for name, variant in VARIANTS.items():
        with console.status(f"SciPy, {variant.title}"):
            fit = peer_fit(problem, start, variant)
        farthest = float(np.max(np.abs((fit.estimate.shared - ours.outcome.estimate.shared) / ours.sigma)))
        found[name] = {
            "title": variant.title,
            "fit_seconds": fit.seconds,
            "cost": fit.cost,
            "jacobians": fit.jacobians,
            "farthest_parameter_in_sigma": farthest,
            "same_end": farthest < EQUAL,
        }
        ratio = fit.seconds / ours.seconds
        table.add_row(variant.title, f"{fit.seconds:.2f}", f"{ratio:.1f}", f"{fit.cost:.2f}", f"{farthest:.3f}", f"{fit.jacobians}")
    console.print(table)
    return {"ratio": {name: each["fit_seconds"] / ours.seconds for name, each in found.items()}, "peers": found}


def _error_table(errors: dict[str, dict[str, float]]) -> Table:
    table = Table("simulator", *CHANNEL_ERRORS, title="Error against DOP853 (rtol 1e-11), in standard deviations of the noise")
    for who, norms in errors.items():
        table.add_row(who, *(f"{value:.1e}" for value in norms.values()))
    return table


if __name__ == "__main__":
    main()
