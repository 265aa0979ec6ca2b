"""Sample of the posterior of the parameters, with its diagnostics, and the file that ArviZ reads."""

import dataclasses
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from identification.result.store import series

FILE_NAME = "posterior.nc"
RHAT_LIMIT = 1.01
"""R-hat above which chains have not met (Vehtari and others 2021)."""
_DRAWS = ("chain", "draw")


@dataclasses.dataclass(frozen=True, kw_only=True)
class PosteriorSample:
    """Draws of the shared parameters from their posterior; the first two axes of arrays are the chain and the draw.

    Attributes:
        names: of the parameters, the last axis of `draws`.
        units: of the parameters.
        draws: SI.
        log_density, divergent, acceptance, steps: of every draw, as in `Chains`.
        rhat: rank-normalised split R-hat of every parameter.
        ess_bulk, ess_tail: effective sample sizes, of the bulk and of the 5 % and 95 % quantiles.

    Source: A. Vehtari, A. Gelman, D. Simpson, B. Carpenter, P.-C. Buerkner, Bayesian Analysis 16 (2021) 667-718; computed by ArviZ.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    draws: np.ndarray = series(*_DRAWS, "parameter", words="draws of the parameters")
    log_density: np.ndarray = series(*_DRAWS, words="log density of the parameters in the coordinates of the fit, up to a constant")
    divergent: np.ndarray = series(*_DRAWS, words="whether the energy error of the trajectory was large")
    acceptance: np.ndarray = series(*_DRAWS, words="rate of acceptance along the trajectory")
    steps: np.ndarray = series(*_DRAWS, words="gradients that the draw took")
    rhat: tuple[float, ...]
    ess_bulk: tuple[float, ...]
    ess_tail: tuple[float, ...]

    @property
    def pooled(self) -> np.ndarray:
        """Draws of all chains, (draws, parameters)."""
        return self.draws.reshape(-1, len(self.names))

    def interval(self, name: str) -> tuple[float, float]:
        """Equal-tailed 95 % interval of a parameter."""
        low, high = np.quantile(self.pooled[:, self.names.index(name)], [0.025, 0.975])
        return float(low), float(high)

    def document(self) -> dict[str, Any]:
        """Summary for `fit.json`."""
        rows = {}
        for index, name in enumerate(self.names):
            values = self.pooled[:, index]
            rows[name] = {
                "mean": float(values.mean()),
                "std": float(values.std(ddof=1)),
                "ci95": self.interval(name),
                "unit": self.units[index],
                "rhat": self.rhat[index],
                "ess_bulk": self.ess_bulk[index],
                "ess_tail": self.ess_tail[index],
            }
        chains, draws = self.log_density.shape
        return {"file": FILE_NAME, "chains": chains, "draws": draws, "divergent": int(self.divergent.sum()), "parameters": rows}

    def warnings(self) -> tuple[str, ...]:
        """Sentences for the reader, where the chains have not met or their trajectories diverged."""
        found = []
        if max(self.rhat) > RHAT_LIMIT:
            worst = self.names[int(np.argmax(self.rhat))]
            found.append(
                f"the chains of the posterior have not met: R-hat of {worst} is {max(self.rhat):.3f}; ask for more draws with --draws"
            )
        if count := int(self.divergent.sum()):
            found.append(f"{count} of {self.divergent.size} trajectories of the posterior's sampler diverged: its tails may be cut off")
        return tuple(found)


def diagnosed(names: tuple[str, ...], units: tuple[str, ...], **arrays: np.ndarray) -> PosteriorSample:
    """The sample with its diagnostics, which ArviZ computes."""
    az = arviz()
    data = az.convert_to_dataset({name: arrays["draws"][..., index] for index, name in enumerate(names)})
    found = {"rhat": az.rhat(data), "ess_bulk": az.ess(data, method="bulk"), "ess_tail": az.ess(data, method="tail")}
    numbers: dict[str, Any] = {key: tuple(float(values[name]) for name in names) for key, values in found.items()}
    return PosteriorSample(names=names, units=units, **arrays, **numbers)


def write_posterior(sample: PosteriorSample, path: Path, attributes: Mapping[str, str]) -> None:
    """Write a NetCDF file with the groups `posterior` and `sample_stats`, as `arviz.from_netcdf` reads it."""
    data = arviz().from_dict(
        posterior={name: sample.draws[..., index] for index, name in enumerate(sample.names)},
        sample_stats={
            "lp": sample.log_density,
            "diverging": sample.divergent,
            "acceptance_rate": sample.acceptance,
            "n_steps": sample.steps,
        },
        attrs=dict(attributes),
    )
    for name, unit in zip(sample.names, sample.units, strict=True):
        data.posterior[name].attrs["units"] = unit
    data.to_netcdf(str(path))


def arviz() -> ModuleType:
    """ArviZ, which announces its next version when it is imported."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import arviz as az
    return az
