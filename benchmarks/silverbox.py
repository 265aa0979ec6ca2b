"""Errors on the published test sets of the Silverbox: `python -m benchmarks.silverbox --data DIR [--model model.json] [--json FILE]`.

The model runs freely along each test set from the state that the first samples show; no measured output corrects it afterwards. As
published, the first 50 samples of a set do not count, and the arrow without extrapolation ends after 32 000 samples.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.machine import machine
from identification.experiment import Experiment, load_experiment
from identification.recipes.load import load_recipe, recipe_experiment
from vibrojax.cli.environment import prepare_jax
from vibrojax.model import Model

RECIPE = "silverbox"
SKIPPED = 50
"""Samples at the beginning of a test set that do not count."""
TEST_SETS = {
    "multisine": ("test-multisine.npz", None),
    "arrow, full": ("test-arrow.npz", None),
    "arrow, no extrapolation": ("test-arrow.npz", 32_000),
}
PUBLISHED_MV = {
    "best black box": (0.36, 1.4, 0.32),
    "sparse NARX": (7.73, 4.15, 2.23),
}
"""RMSE in mV, in the order of `TEST_SETS`, from the table of results at nonlinearbenchmark.org."""


def main() -> None:
    """Print the table, and write it as JSON where asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings, or the one above it")
    parser.add_argument("--model", type=Path, help="model.json of a fit or a diagnosis; left out: the linear model is fitted first")
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    options = parser.parse_args()
    prepare_jax()
    with recipe_experiment(load_recipe(RECIPE), options.data) as folder:
        experiment = load_experiment(folder)
    model = _model(options.model, experiment)
    errors = test_errors(model, experiment)
    for name, error in errors.items():
        print(f"{name:24} {1e3 * error:8.3f} mV")
    if options.json is not None:
        document = {"rmse_mv": {name: 1e3 * error for name, error in errors.items()}, "published_mv": PUBLISHED_MV, "machine": machine()}
        options.json.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def test_errors(model: Model, experiment: Experiment) -> dict[str, float]:
    """Root mean square error of a free run on each test set, V."""
    from identification.estimation.simulate import simulate_record

    records, errors = {record.file: record for record in experiment.records}, {}
    for name, (file, samples) in TEST_SETS.items():
        record = records[file]
        predicted = simulate_record(model, record)["hammer_displacement"]
        error = (predicted - record.channels["hammer_displacement"])[SKIPPED:samples]
        errors[name] = float(np.sqrt(np.mean(error**2)))
    return errors


def _model(file: Path | None, experiment: Experiment) -> Model:
    """The model of a file, or the linear one fitted to the estimation records."""
    if file is not None:
        from vibrojax.model_file import read_model

        return read_model(file)
    from identification.estimation.estimate import fit_experiment

    return fit_experiment(experiment.fitting).model


if __name__ == "__main__":
    main()
