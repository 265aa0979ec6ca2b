"""Experiments fitted as chains: convergence, random force, reading errors, one-step errors, and the parameters' distance from the truth.

    python -m benchmarks.trajectory FOLDER ... --json trajectory.json

A folder is an experiment; where it holds `sealed/truth.json` of a simulated rig, parameters are compared with it. The nominal model is
fitted: with an effect concealed, its parameters are wrong by what the random force does not take.
"""

import dataclasses
import json
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax


def truth(folder: Path, mass: float) -> dict[str, float]:
    """True parameters of a simulated rig by name; empty where none are stated."""
    file = folder / "sealed" / "truth.json"
    if not file.is_file():
        return {}
    nominal = json.loads(file.read_text(encoding="utf-8"))["nominal"]
    omega = float(np.sqrt(nominal["k"] / mass))
    contact = {"k_i": nominal["ki"], "n": nominal["n"], "lambda_i": nominal["lam"]}
    return contact | {"zeta": nominal["c"] / (2.0 * mass * omega), "f_n": omega / (2.0 * np.pi)}


def fitted(folder: Path) -> dict:
    """One experiment; a failure is a result too."""
    from identification.experiment import load_experiment
    from identification.trajectory.fit import fit
    from identification.trajectory.innovations import whiteness
    from identification.trajectory.start import problem_of

    before = time.perf_counter()
    try:
        problem = problem_of(load_experiment(folder))
        found = fit(problem)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted
        return {"folder": folder.name, "failure": f"{type(error).__name__}: {error}"}
    true, values, errors = truth(folder, problem.experiment.mass), problem.values(found.at), {}
    for (name, logarithmic), error in zip(problem.unknowns.shared, found.stderr, strict=True):
        if name in true and error > 0:
            off = np.log(values[name] / true[name]) if logarithmic else values[name] - true[name]
            errors[name] = float(off / error)
    return {
        "folder": folder.name,
        "converged": found.converged,
        "rounds": found.rounds,
        "seconds": time.perf_counter() - before,
        "force_share": found.variances.force.std / problem.scales.force,
        "memory": found.variances.force.memory,
        "orders": dict(zip(problem.chains.channels, (one.order for one in found.variances.readings), strict=True)),
        "whiteness": {name: dataclasses.asdict(one) for name, one in whiteness(found).items()},
        "values": values,
        "sigmas": errors,
    }


def main(
    folders: Annotated[list[Path], typer.Argument(help="Experiments.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="File for the result.")] = None,
) -> None:
    """Fit each experiment as chains."""
    prepare_jax()
    columns = "experiment", "converged", "rounds", "s", "force / suspension", "orders", "one-step variance", "off by, standard errors"
    table, found = Table(*columns), []
    for folder in folders:
        one = fitted(folder)
        found.append(one)
        if "failure" in one:
            table.add_row(one["folder"], "no", "", "", "", "", "", one["failure"])
            continue
        sigmas = ", ".join(f"{name} {value:+.2f}" for name, value in one["sigmas"].items())
        orders = "".join(str(order) for order in one["orders"].values())
        row = (
            "yes" if one["converged"] else "NO",
            str(one["rounds"]),
            f"{one['seconds']:.1f}",
            f"{one['force_share']:.1e}",
            orders,
            " ".join(f"{channel['variance']:.2f}" for channel in one["whiteness"].values()),
            sigmas,
        )
        table.add_row(one["folder"], *row)
    Console(highlight=False).print(table)
    if json_file is not None:
        json_file.write_text(json.dumps({"machine": machine(), "fits": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
