"""One experiment, fitted: 95 % intervals of its parameters by three methods, and the diagnostics of the sampler."""

import dataclasses
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.machine import revision
from benchmarks.posterior.curved import write_curved

if TYPE_CHECKING:
    from identification.result.result import FitResult, LikelihoodProfile, ParameterEstimate

NORMAL = 1.96
"""Half-width of the normal 95 % interval, standard errors; its square is the rise of a profile at its ends."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """One experiment: a folder, or the simulated one whose likelihood is curved where there is none."""

    name: str
    folder: Path | None
    draws: int
    """Of each of four chains."""


def trial(job: Job) -> dict:
    """Fit an experiment with profiles and a posterior; a failure is a result too."""
    found: dict = {"name": job.name, "draws": job.draws, "revision": revision()}
    before, busy = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as made:
        try:
            if job.folder is None:
                write_curved(Path(made))
            found |= _fitted(job.folder or Path(made), job.draws)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is shown
            found |= {"failure": f"{type(error).__name__}: {error}"}
    minutes = {"minutes": time.perf_counter() - before, "processor_minutes": time.process_time() - busy}
    return found | {name: seconds / 60.0 for name, seconds in minutes.items()}


def _fitted(folder: Path, draws: int) -> dict:
    """Intervals of the fit of the nominal model, and the diagnostics of its posterior."""
    from identification.estimation.estimate import fit_experiment
    from identification.experiment import load_experiment
    from identification.likelihood.sampling.nuts import Nuts

    result = fit_experiment(load_experiment(folder), posterior_by=Nuts(draws=draws), with_profiles=True)
    sample = result.posterior
    assert sample is not None
    return {
        "parameters": intervals(result),
        "converged": result.converged,
        "rhat": max(sample.rhat),
        "ess": min(*sample.ess_bulk, *sample.ess_tail),
        "divergent": int(sample.divergent.sum()),
        "gradients": float(sample.steps.mean()),
        "seconds": result.seconds,
        "warnings": list(result.warnings),
    }


def intervals(result: "FitResult") -> dict[str, dict | None]:
    """Ends of the intervals by NUTS and profile likelihood, by parameter; None for a parameter without a standard error.

    They are in standard errors from the estimate, in the coordinates of the fit (logarithms, except of exponents): that of the standard
    error goes from -1.96 to 1.96.
    """
    assert result.posterior is not None and result.profiles is not None
    curves = {curve.name: curve for curve in result.profiles.single}
    found: dict[str, dict | None] = {}
    for one in result.parameters:
        name = one.spec.name
        if one.stderr is None or name not in curves:
            found[name] = None
            continue
        nuts = in_standard_errors(one, result.posterior.interval(name)).tolist()
        found[name] = {"value": one.value, "stderr": one.stderr, "nuts": nuts, "profile": profile_interval(one, curves[name])}
    return found


def in_standard_errors(one: "ParameterEstimate", values: tuple[float, ...]) -> np.ndarray:
    """Distance of values of a parameter from its estimate, in its standard errors, in the coordinates of the fit."""
    assert one.stderr is not None
    internal = np.array([one.spec.to_internal(value) for value in values])
    return (internal - one.spec.to_internal(one.value)) * one.spec.slope(one.value) / one.stderr


def profile_interval(one: "ParameterEstimate", curve: "LikelihoodProfile") -> list[float | None]:
    """Where the profile has risen by 1.96²; None for an end beyond the profile.

    Interpolated is the signed root of the rise, which is a straight line for a normal likelihood.
    """
    at = in_standard_errors(one, curve.values)
    root = np.sign(at) * np.sqrt(np.maximum(np.array(curve.rise), 0.0))
    ends = []
    for side in (-1.0, 1.0):
        way = np.flatnonzero(side * at >= -1e-9)[:: int(side)]
        risen = np.maximum.accumulate(side * root[way])
        ends.append(float(np.interp(NORMAL, risen, at[way])) if risen[-1] >= NORMAL else None)
    return ends
