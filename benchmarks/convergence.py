"""How fast the smoothed contact law converges to the discontinuous one, as the width epsilon of its switch goes to zero.

    python -m benchmarks.convergence --out DIR [--quick]

Three comparisons, each with the switch model as the reference: (a) trajectories over several impacts, (b) their derivatives with respect to
k_i, n, lambda_i, zeta and omega_n, (c) a bifurcation diagram across a grazing, of a stop so stiff that the width exceeds the
indentation: wide smoothing moves the chaotic band, invents branches or hides them; narrow smoothing does not (context: Elmegård et al.,
arXiv 1308.3647).

Prints a table of slopes; writes `convergence.json` and `trajectories.png`, `gradients.png`, `bifurcations.png` into DIR.
About a minute on two cores; `--quick` takes about fifteen seconds, nearly all of it compiling, and shows nothing about (c).
"""

import json
import platform
import time
from pathlib import Path
from typing import Annotated

import jax
import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from benchmarks import convergence_plots, convergence_studies


def main(
    out: Annotated[Path, typer.Option(help="folder for figures and numbers")],
    quick: Annotated[bool, typer.Option(help="small sizes, seconds instead of minutes")] = False,
) -> None:
    """Measure the convergence of the smoothed law to the discontinuous law."""
    jax.config.update("jax_enable_x64", True)
    out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    console = Console(width=110)
    widths = np.geomspace(1e-5, 1e-3, 5) if quick else np.geomspace(1e-7, 1e-3, 33)
    laws = dict(list(convergence_studies.LAWS.items())[: 1 if quick else None])
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:

        def track(items, description):
            return progress.track(items, description=description)

        trajectories = convergence_studies.trajectories(laws, widths, track)
        gradients = convergence_studies.gradients(widths, track)
        diagram = convergence_studies.bifurcations(convergence_studies.QUICK if quick else convergence_studies.FULL, track)

    convergence_plots.errors(trajectories, out / "trajectories.png", "largest error of u over its range")
    convergence_plots.errors(gradients, out / "gradients.png", "relative error of ∂u/∂(parameter)")
    convergence_plots.bifurcations(diagram, out / "bifurcations.png")
    seconds = time.perf_counter() - start
    _print(console, trajectories, gradients, diagram)
    console.print(f"{seconds:.0f} s; figures in {out}")
    report = {
        "trajectories": [curve._asdict() for curve in trajectories],
        "gradients": [curve._asdict() for curve in gradients],
        "bifurcations": diagram.summary(),
        "provenance": {"quick": quick, "seconds": seconds, "jax": jax.__version__, "numpy": np.__version__, "machine": platform.machine()},
    }
    (out / "convergence.json").write_text(json.dumps(report, indent=1, default=lambda array: array.tolist()), encoding="utf-8")


def _print(console: Console, trajectories, gradients, diagram) -> None:
    slopes = Table(
        "comparison", "of", "slope p, error ~ ε^p", "fitted over ε (m)", "error at 10 µm", title="Smoothed law → discontinuous law"
    )
    for comparison, curves in (("trajectory", trajectories), ("gradient", gradients)):
        for curve in curves:
            fitted = f"{curve.fit_widths[0]:.1e} … {curve.fit_widths[1]:.1e}" if curve.fit_widths else "-"
            error = np.exp(np.interp(np.log(1e-5), np.log(curve.widths), np.log(curve.errors)))
            slopes.add_row(comparison, curve.label, f"{curve.slope:.2f}", fitted, f"{error:.1e}")
    console.print(slopes)
    branches = Table("ε (m)", "period differs from switch model", "median error of u' (period 1 in both)", title="Bifurcation diagram")
    for row in diagram.summary()["widths"]:
        branches.add_row(f"{row['smoothing']:.0e}", f"{row['wrong_period']} of {row['of']} frequencies", f"{row['median_error']:.1e}")
    console.print(branches)


if __name__ == "__main__":
    typer.run(main)
