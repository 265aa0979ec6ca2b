"""One experiment, fitted: 95 % intervals of its parameters by three methods, and how good the sample is."""

import dataclasses
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.machine import revision
from benchmarks.posterior.curved import write_curved

if TYPE_CHECKING:
    from identification.result.result import FitResult, LikelihoodProfile, ParameterEstimate

NORMAL = 1.96
"""Half-width of the normal 95 % interval, standard errors; its square is the rise of a profile at its ends."""
_FARTHEST = 4.5
"""Signed root of the rise of a profile beyond which its area does not count."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """One experiment: a folder, or the simulated one whose likelihood is curved where there is none."""

    name: str
    folder: Path | None
    draws: int
    """Weighted ones."""


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
    """Intervals of the fit of the nominal model, and how good the sample of its posterior is."""
    from identification.estimation.estimate import fit_experiment
    from identification.experiment import load_experiment

    result = fit_experiment(load_experiment(folder), draws=draws, with_profiles=True)
    sample = result.posterior
    assert sample is not None
    return {
        "parameters": intervals(result),
        "converged": result.converged,
        "effective": sample.effective,
        "tail": sample.tail,
        "seconds": result.seconds,
        "warnings": list(result.warnings),
    }


def intervals(result: "FitResult") -> dict[str, dict | None]:
    """Ends of the intervals by profile likelihood and weighted draws, by parameter; None for a parameter without a standard error.

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
        draws = in_standard_errors(one, result.posterior.interval(name)).tolist()
        by = {"profile": profile_interval(one, curves[name]), "area": area_interval(one, curves[name]), "draws": draws}
        found[name] = {"value": one.value, "stderr": one.stderr} | by
    return found


def in_standard_errors(one: "ParameterEstimate", values: tuple[float, ...]) -> np.ndarray:
    """Distance of values of a parameter from its estimate, in its standard errors, in the coordinates of the fit."""
    assert one.stderr is not None
    internal = np.array([one.spec.to_internal(value) for value in values])
    return (internal - one.spec.to_internal(one.value)) * one.spec.slope(one.value) / one.stderr


def profile_interval(one: "ParameterEstimate", curve: "LikelihoodProfile") -> list[float | None]:
    """Where the profile has risen by 1.96²; None for an end beyond the profile."""
    at, root = signed_root(one, curve)
    low, high = np.interp([-NORMAL, NORMAL], root, at)
    return [float(low) if root[0] <= -NORMAL else None, float(high) if root[-1] >= NORMAL else None]


def area_interval(one: "ParameterEstimate", curve: "LikelihoodProfile") -> list[float]:
    """Interval that holds the middle 95 % of the area under the profile likelihood.

    It is that of the posterior with a prior flat in the coordinates of the fit, but for the volume of the other parameters. The profile is
    a cubic spline in the signed root of its rise, also beyond its ends.
    """
    at, root = signed_root(one, curve)
    fine = np.linspace(-_FARTHEST, _FARTHEST, 4001)
    way = np.maximum.accumulate(CubicSpline(root, at)(fine))
    share = np.cumsum(np.exp(-0.5 * fine**2) * np.gradient(way))
    return np.interp([0.025, 0.975], share / share[-1], way).tolist()


def signed_root(one: "ParameterEstimate", curve: "LikelihoodProfile") -> tuple[np.ndarray, np.ndarray]:
    """Distance of the profile's points in standard errors, and the root of their rise with its sign: the same for a normal likelihood."""
    at = in_standard_errors(one, curve.values)
    root = np.sign(at) * np.sqrt(np.maximum(np.array(curve.rise), 0.0))
    rises = np.concatenate([[True], np.diff(np.maximum.accumulate(root)) > 0])
    return at[rises], root[rises]
