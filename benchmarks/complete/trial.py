"""One awkward experiment with a complete model, fitted, beside its truth."""

import tempfile
import time
from pathlib import Path

from benchmarks.complete.rigs import Awkward, Job, write_awkward
from benchmarks.coverage.trial import beside_truth
from benchmarks.machine import revision

CHI2 = (0.95, 1.05)
"""Reduced chi-square of a right fit."""
MOST_ERRORS = 3.0
"""Distance of a right parameter from the truth, standard errors."""


def trial(job: Job) -> dict:
    """Simulate and fit one experiment; a failure is a result too."""
    found: dict = {"key": job.key, "revision": revision()}
    with tempfile.TemporaryDirectory() as folder:
        drawn = write_awkward(Path(folder), job)
        found |= drawn.numbers()
        before = time.perf_counter()
        try:
            found |= _fitted(Path(folder), drawn)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted
            found |= {"failure": f"{type(error).__name__}: {error}"}
    return found | {"seconds": time.perf_counter() - before, "right": is_right(found)}


def is_right(found: dict) -> bool:
    """Whether a fit converged with a chi-square of noise, all parameters identified and within `MOST_ERRORS` of the truth."""
    if "failure" in found or not found["converged"]:
        return False
    z = [row["z"] for row in found["rows"] if "record" not in row]
    return CHI2[0] <= found["chi2_reduced"] <= CHI2[1] and all(one is not None and abs(one) <= MOST_ERRORS for one in z)


def _fitted(folder: Path, drawn: Awkward) -> dict:
    """Estimates beside the truth, and how well each record is explained."""
    from identification.estimation.estimate import fit_experiment
    from identification.experiment import load_experiment

    result = fit_experiment(load_experiment(folder))
    return {
        "rows": beside_truth(result, drawn.rig, drawn.plans),
        "chi2_reduced": result.chi2_reduced,
        "records": {one.file: one.chi2_reduced for one in result.records},
        "converged": result.converged,
        "warnings": list(result.warnings),
    }
