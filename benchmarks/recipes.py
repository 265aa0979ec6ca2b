"""Fits of real recordings, printed as the tables of `data/recipes/*/README.md`: `python -m benchmarks.recipes --data DIR NAME…`."""

import argparse
from pathlib import Path

import numpy as np

from identification.experiment import load_experiment
from identification.recipes.load import load_recipe, recipe_experiment, recipe_names
from identification.result.result import FitResult, RecordFit
from vibrojax.cli.environment import prepare_jax

_EDGE_S = 0.05
"""Length of the straight lines that give a speed before and after a collision, s."""


def main() -> None:
    """Fit the named recipes (all, if none is named) and print a table of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder above the data sets")
    parser.add_argument("--law", help="contact law instead of the recipe's own")
    parser.add_argument("names", nargs="*", metavar="NAME", help="recipes; all if none is named")
    options = parser.parse_args()
    prepare_jax()
    from identification.estimation.estimate import fit_experiment

    for name in options.names or recipe_names():
        recipe = load_recipe(name)
        with recipe_experiment(recipe, options.data) as folder:
            result = fit_experiment(load_experiment(folder), law=options.law)
        print_fit(name, result)
        if recipe.reader == "air-track":
            print_restitution((*result.records, *result.held_back))


def print_fit(name: str, result: FitResult) -> None:
    """Parameters with their errors, and how well each channel of each record is met."""
    end = "converged" if result.converged else "NOT CONVERGED"
    print(f"{name}: law {result.model.law.name}, reduced chi-square {result.chi2_reduced:.3g}, {end}, {sum(result.seconds.values()):.0f} s")
    for row in result.parameters:
        print(f"  {row.spec.name:9} {_with_error(row.value, row.stderr)} {row.spec.unit}  {row.status}")
    for row in result.derived:
        print(f"  {row.name:9} {_with_error(row.value, row.stderr)} {row.unit}")
    for record in (*result.records, *result.held_back):
        held = "  (held back)" if record in result.held_back else ""
        for channel, share in record.nrmse.items():
            rms = share * np.nanstd(record.measured[channel])
            print(f"  {record.file:18} {channel:22} rms error {rms:9.3g}, {100 * share:5.1f} % of the channel's own{held}")


def print_restitution(records: tuple[RecordFit, ...]) -> None:
    """Speed after over speed before each collision, as recorded and as fitted, by the same straight lines."""
    print("  speed m/s   e recorded   e fitted")
    for record in records:
        v, recorded = _restitution(record.time, record.measured["relative_displacement"])
        _, fitted = _restitution(record.time, record.predicted["relative_displacement"])
        print(f"  {v:9.3f}   {recorded:10.3f}   {fitted:8.3f}")


def _restitution(time: np.ndarray, u: np.ndarray) -> tuple[float, float]:
    """Speed at the beginning, and minus that at the end over it."""
    before, after = (
        np.polyfit(time[part], u[part], 1)[0]
        for part in (np.isfinite(u) & (time < time[0] + _EDGE_S), np.isfinite(u) & (time > time[-1] - _EDGE_S))
    )
    return float(before), float(-after / before)


def _with_error(value: float, stderr: float | None) -> str:
    return f"{value:.4g}" + (f" ± {stderr:.2g}" if stderr is not None else "")


if __name__ == "__main__":
    main()
