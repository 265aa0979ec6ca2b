"""Parameter values that a fit leaves possible, drawn at random."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from vibrojax.errors import InputError
from vibrojax.json_file import read_json
from vibrojax.model import MASS, Model
from vibrojax.model_file import read_model
from vibrojax.parameters import Parameter

_ROUNDS = 1000
_SAME = 1e-6
_REMEDY = "expected the fit.json and model.json that one run of fit-parameters wrote"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Draws:
    """Sets of parameter values, each one possible truth.

    Attributes:
        names: of the parameters that were drawn.
        values: SI.
        seed: of the random numbers.
    """

    names: tuple[str, ...]
    values: Float[np.ndarray, "draw parameter"]
    seed: int

    def model(self, model: Model, draw: int) -> Model:
        """The model with the values of one draw."""
        return model.replace(dict(zip(self.names, self.values[draw].tolist(), strict=True)))

    def document(self) -> dict[str, Any]:
        """As JSON can hold it."""
        return {"seed": self.seed, "count": len(self.values), "names": list(self.names), "values": self.values.tolist()}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fit:
    """What a fit knows of its parameters: a normal distribution in the coordinates in which the fit moves (logarithms, mostly).

    Attributes:
        model: at the best values.
        parameters: those with a standard error; every draw keeps the model's value of the others.
        centre: best values, internal coordinates.
        covariance: in internal coordinates.
    """

    model: Model
    parameters: tuple[Parameter, ...]
    centre: Float[np.ndarray, " parameter"]
    covariance: Float[np.ndarray, "parameter parameter"]

    def draw(self, count: int, *, seed: int) -> Draws:
        """Draw parameter values; what lies outside the range of a parameter is drawn again.

        Raises:
            InputError: fewer than one draw, or hardly any within the ranges.
        """
        if count < 1:
            raise InputError(f"{count} draws: expected at least 1; correct it")
        rng, kept = np.random.default_rng(seed), np.empty((0, len(self.parameters)))
        for _ in range(_ROUNDS):
            trial = rng.multivariate_normal(self.centre, self.covariance, size=count, method="eigh")
            with np.errstate(over="ignore"):  # an infinite value is outside every range
                values = np.array([[p.to_physical(x) for p, x in zip(self.parameters, row, strict=True)] for row in trial])
            inside = [all(p.lower <= x <= p.upper for p, x in zip(self.parameters, row, strict=True)) for row in values]
            kept = np.concatenate([kept, values[inside]])[:count]
            if len(kept) == count:
                return Draws(names=tuple(p.name for p in self.parameters), values=kept, seed=seed)
        raise InputError("hardly any draw lies within the parameters' ranges: the fit determines them too poorly; record more, or fix some")


def read_fit(folder: Path) -> Fit:
    """Read the folder of a fit: values from `model.json`, errors and correlations from `fit.json`.

    Standard errors are those of the fit's own coordinates, carried to SI along the slope; here they are carried back.

    Raises:
        InputError: a file is missing or broken, the two do not belong together, or no parameter has an error.
    """
    model, path = read_model(folder / "model.json"), folder / "fit.json"
    known = {p.name: p for p in (*model.parameters, MASS)}
    best = {name: float(np.asarray(value)) for name, value in (model.values() | {MASS.name: model.mass}).items()}
    document = read_json(path, "the fit.json of a fit")
    try:
        values, errors, names, matrix = _numbers(document)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(f"{path} is no fit.json ({type(error).__name__}: {str(error)[:200]}): {_REMEDY}") from error
    for name, value in values.items():
        if name not in known or not np.isclose(value, best[name], rtol=_SAME, atol=0.0):
            raise InputError(f"{path} has {name[:60]} = {value:g}, model.json has {best.get(name, 'none')}: {_REMEDY}")
    chosen = [name for name in names if errors.get(name, 0.0) > 0]
    if not chosen or not np.all(np.isfinite(matrix)):
        raise InputError(f"{path} gives no parameter a standard error and correlations: nothing can be drawn; {_REMEDY}")
    index = [names.index(name) for name in chosen]
    parameters = tuple(known[name] for name in chosen)
    spread = np.array([errors[p.name] / p.slope(best[p.name]) for p in parameters])
    return Fit(
        model=model,
        parameters=parameters,
        centre=np.array([p.to_internal(best[p.name]) for p in parameters]),
        covariance=matrix[np.ix_(index, index)] * np.outer(spread, spread),
    )


def _numbers(document: Any) -> tuple[dict[str, float], dict[str, float], list[str], Float[np.ndarray, "parameter parameter"]]:
    """Values and standard errors by name, and the correlation matrix with the names of its rows.

    Raises:
        ValueError, KeyError, TypeError, AttributeError, OverflowError: the document is no fit.json.
    """
    listed, correlation = document["parameters"], document["correlation"]
    names, matrix = list(correlation["names"]), np.array(correlation["matrix"], dtype=np.float64)
    if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ValueError("names of correlations are no different texts")
    if matrix.shape != (len(names), len(names)):
        raise ValueError(f"a matrix of correlations of shape {matrix.shape} for {len(names)} names")
    values = {str(name): float(part["value"]) for name, part in listed.items()}
    errors = {str(name): float(part["stderr"]) for name, part in listed.items() if part["stderr"] is not None}
    if not all(map(math.isfinite, (*values.values(), *errors.values()))):
        raise ValueError("a value or standard error that is not finite")
    rounding = _SAME * max(1, len(matrix))
    sound = np.allclose(matrix, matrix.T, rtol=0.0, atol=rounding) and np.allclose(np.diag(matrix), 1.0, rtol=0.0, atol=rounding)
    if np.all(np.isfinite(matrix)) and not (sound and (len(matrix) == 0 or float(np.linalg.eigvalsh(matrix)[0]) >= -rounding)):
        raise ValueError("a matrix of correlations that is none: not symmetric, not 1 on its diagonal, or not positive semidefinite")
    return values, errors, names, matrix
