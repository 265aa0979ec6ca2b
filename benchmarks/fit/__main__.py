"""`python -m benchmarks.fit --json FILE`: our whole fit beside SciPy's, at equal accuracy, and the whole command cold and warm.

Both fit the same records (the embedded example unless others are named) from the same start: we as chains, with the random force and the
readings' errors estimated, the peer as windows with free initial states under the noise as declared. SciPy is called in three ways: as
documented (dense two-point differences), by MINPACK, and with `jac_sparsity`, which lets it difference many window states at once; always
with `x_scale="jac"`, without which it fares worse.
"""

import argparse
import dataclasses
import json
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

SUBSTEPS = 2
"""Contact steps of the peer in one sample: its error is then the nearest to ours from below."""
EQUAL = 3.0
"""Ends count as the same when no parameter differs by more than this many standard errors of the peer, whose windows say less."""
NORMS = {"rms": lambda e: float(np.sqrt(np.mean(e**2))), "largest": lambda e: float(np.max(np.abs(e)))}


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
    from benchmarks.fit.ours import best_time, jacobian_cost, our_fit, our_residuals
    from benchmarks.fit.peer import Problem
    from benchmarks.fit.reference import reference_residuals
    from identification.experiment import load_experiment
    from identification.trajectory.start import problem_of
    from vibrojax.data_files import data_path

    with console.status("a start for both"):
        chain = problem_of(load_experiment(options.experiment or data_path("example")))
        if len(chain.chains.groups) != 1 or (chain.model.law.name, chain.model.suspension.name) != ("hunt-crossley", "linear"):
            raise SystemExit(
                "the peer knows a linear suspension, Hunt and Crossley's law and records of the same channels: choose another one"
            )
        problem = Problem(chain, substeps=SUBSTEPS)
    with console.status("our fit"):
        ours = our_fit(chain, repeats=options.repeats)
        simulation, jacobian = jacobian_cost(ours.fitted, repeats=5 * options.repeats)
    best = dataclasses.replace(problem.start, shared=ours.fitted.at.shared)
    peer_simulation = best_time(lambda: problem.data_residuals(best), 5 * options.repeats)
    with console.status("errors of both simulators against DOP853"):
        exact = reference_residuals(problem.windows, problem.values(best), best)
        error = {"ours": our_residuals(chain, problem.windows, best) - exact, "peer": problem.data_residuals(best) - exact}
    errors = {who: {name: norm(values) for name, norm in NORMS.items()} for who, values in error.items()}
    columns = len(chain.unknowns.shared)
    result = {
        "problem": {"records": len(chain.experiment.records), "windows": len(problem.windows.record), **problem.size(best)},
        "simulation_error_in_sigma": errors,
        "simulation_seconds": {"ours": simulation, "peer": peer_simulation},
        "jacobian_cost": jacobian / simulation,
        "jacobian": {"simulation_seconds": simulation, "value_and_jacobian_seconds": jacobian, "columns": columns},
        "ours": {
            "fit_seconds": float(np.median(ours.seconds)),
            "first_fit_seconds": ours.first_seconds,
            "values": chain.values(ours.fitted.at),
            "stderr": ours.fitted.stderr.tolist(),
        },
    }
    console.print(_error_table(errors, result["simulation_seconds"]))
    console.print(f"value and Jacobian in {columns} parameters: {jacobian / simulation:.1f} simulations ({simulation * 1e3:.1f} ms)")
    if "peer" in options.skip:
        return result
    result |= _peers(problem, ours.fitted, console)
    again = our_fit(chain, repeats=options.repeats)
    return result | _ratios(result, float(np.median(ours.seconds + again.seconds)), console)


def _peers(problem, fitted, console: Console) -> dict:
    from benchmarks.fit.peer import VARIANTS, peer_fit

    found = {}
    for name, variant in VARIANTS.items():
        with console.status(variant.title):
            fit = peer_fit(problem, problem.start, variant)
        farthest = float(np.max(np.abs((fit.at.shared - fitted.at.shared) / fit.sigma)))
        found[name] = {
            "title": variant.title,
            "fit_seconds": fit.seconds,
            "cost": fit.cost,
            "stderr": fit.sigma.tolist(),
            "jacobians": fit.jacobians,
            "seconds_per_jacobian": None if fit.jacobians is None else fit.seconds / fit.jacobians,
            "farthest_parameter_in_sigma": farthest,
            "same_end": farthest < EQUAL,
        }
    return {"peers": found}


def _ratios(result: dict, seconds: float, console: Console) -> dict:
    """Our time is the median of runs before and after the peers', so that a busy machine is as unfair to both."""
    table = Table("fit", "s", "times ours", "farthest parameter, σ", "Jacobians", title="The whole fit, compiled before")
    table.add_row("ours", f"{seconds:.2f}", "1", "0", "")
    for peer in result["peers"].values():
        ratio, farthest = f"{peer['fit_seconds'] / seconds:.1f}", f"{peer['farthest_parameter_in_sigma']:.3f}"
        table.add_row(peer["title"], f"{peer['fit_seconds']:.2f}", ratio, farthest, str(peer["jacobians"] or "–"))
    console.print(table)
    ratios = {name: peer["fit_seconds"] / seconds for name, peer in result["peers"].items()}
    return {"ratio": ratios, "ours": result["ours"] | {"fit_seconds": seconds}}


def _error_table(errors: dict[str, dict[str, float]], seconds: dict[str, float]) -> Table:
    title = "One simulation of all windows; its error against DOP853 (rtol 1e-11) in standard deviations of the noise"
    table = Table("simulator", *(f"{name} error" for name in NORMS), "ms", title=title)
    for who, norms in errors.items():
        table.add_row(who, *(f"{value:.1e}" for value in norms.values()), f"{seconds[who] * 1e3:.1f}")
    return table


if __name__ == "__main__":
    main()
