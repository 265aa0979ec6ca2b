"""Sample of the posterior of the parameters, with its diagnostics, and the file that ArviZ reads."""

import dataclasses
import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from identification.result.store import series
from vibrojax.errors import InputError

FILE_NAME = "posterior.nc"
INSTALL = 'pip install "vibrojax[bayes]"'
SHAPE_LIMIT = 0.7
"""Shape of the weights' tail above which a weighted mean is not reliable (Vehtari and others 2024)."""


def check_extra() -> None:
    """Raise `InputError`, with what to install, where the package of the extra `bayes` is missing."""
    if find_spec("arviz") is None:
        raise InputError(f"a posterior needs the package arviz, not installed: run {INSTALL}, or leave the posterior out")


@dataclasses.dataclass(frozen=True, kw_only=True)
class PosteriorSample:
    """Weighted draws of the shared parameters, SI, from their posterior.

    The log density is up to a constant, in the coordinates of the fit; weights are smoothed and sum to 1. Where the shape of their `tail`
    is above `SHAPE_LIMIT`, the draws do not represent the posterior.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    draws: np.ndarray = series("draw", "parameter", words="draws of the parameters")
    log_density: np.ndarray = series("draw", words="log density of the parameters in the coordinates of the fit, up to a constant")
    weight: np.ndarray = series("draw", words="weight of the draw in the posterior")
    tail: float

    @property
    def effective(self) -> float:
        """Effective sample size: how many equally weighted draws these are worth."""
        return float(1.0 / np.sum(self.weight**2))

    @property
    def pooled(self) -> np.ndarray:
        """As many draws of equal weight, (draws, parameters), by systematic resampling."""
        count = len(self.weight)
        places = np.searchsorted(np.cumsum(self.weight), (np.arange(count) + 0.5) / count)
        return self.draws[np.minimum(places, count - 1)]

    def moments(self, name: str) -> tuple[float, float]:
        """Mean and standard deviation of a parameter."""
        values = self.draws[:, self.names.index(name)]
        mean = float(self.weight @ values)
        return mean, float(np.sqrt(self.weight @ (values - mean) ** 2))

    def interval(self, name: str) -> tuple[float, float]:
        """Equal-tailed 95 % interval of a parameter."""
        values = self.draws[:, self.names.index(name)]
        order = np.argsort(values)
        share = np.cumsum(self.weight[order]) - 0.5 * self.weight[order]
        low, high = np.interp([0.025, 0.975], share, values[order])
        return float(low), float(high)

    def document(self) -> dict[str, Any]:
        """Summary for `fit.json`."""
        rows = {}
        for name, unit in zip(self.names, self.units, strict=True):
            mean, std = self.moments(name)
            rows[name] = {"mean": mean, "std": std, "ci95": self.interval(name), "unit": unit}
        return {"file": FILE_NAME, "draws": len(self.weight), "effective": self.effective, "tail": self.tail, "parameters": rows}

    def warnings(self) -> tuple[str, ...]:
        """Sentences for the reader, where the draws do not represent the posterior."""
        if self.tail <= SHAPE_LIMIT:
            return ()
        return (
            f"few draws carry the posterior (shape of the weights' tail {self.tail:.2f}, reliable up to {SHAPE_LIMIT}): it is far from "
            "normal; trust the profiles of the likelihood, or ask for more draws with --draws",
        )


def weighted(
    names: tuple[str, ...], units: tuple[str, ...], *, draws: np.ndarray, log_density: np.ndarray, log_proposal: np.ndarray
) -> PosteriorSample:
    """The sample with weights, density over that of the draws; ArviZ smooths their tail."""
    ratio = np.where(np.isfinite(log_density), log_density - log_proposal, -np.inf)
    log_weight, tail = arviz().psislw(np.where(np.isfinite(ratio), ratio, np.nanmin(ratio[np.isfinite(ratio)]) - 700.0))
    weight = np.exp(np.asarray(log_weight) - np.max(log_weight))
    return PosteriorSample(
        names=names, units=units, draws=draws, log_density=log_density, weight=weight / weight.sum(), tail=float(np.asarray(tail))
    )


def write_posterior(sample: PosteriorSample, path: Path, attributes: Mapping[str, str]) -> None:
    """Write draws of equal weight as a NetCDF file with the group `posterior`, as `arviz.from_netcdf` reads it."""
    pooled = sample.pooled
    data = arviz().from_dict(posterior={name: pooled[None, :, index] for index, name in enumerate(sample.names)}, attrs=dict(attributes))
    for name, unit in zip(sample.names, sample.units, strict=True):
        data.posterior[name].attrs["units"] = unit
    data.to_netcdf(str(path))


def arviz() -> ModuleType:
    """ArviZ, which announces its next version when it is imported."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import arviz as az
    return az
