"""What every study hands back: an xarray data set with units and provenance.

To add one: write a file with a function that takes a `Model` and keyword settings and returns `labelled(...)`, a function
`(Dataset) -> Figure` in `figures/lines.py` or `figures/maps.py` that is listed in `figures/__init__.py`, and a command in
`vibrojax/cli/study.py`.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from vibrojax import __version__
from vibrojax.batch import SETTINGS, Responses
from vibrojax.errors import InputError
from vibrojax.integrate.base import RESULT_MESSAGES, SUCCESS
from vibrojax.model import MASS, Model
from vibrojax.model_file import model_document

GRAVITY = 9.81
"""m/s^2, as in the thesis."""
CHAOS = 0.01
"""Lyapunov exponent per cycle above which an aperiodic motion is called chaotic."""
Values = Sequence[float] | np.ndarray
"""Along one axis."""


class Labelled(NamedTuple):
    """An array with the names of its axes, its unit, and what it is."""

    dims: tuple[str, ...]
    values: Any
    unit: str
    meaning: str


def axis(model: Model, name: str, values: np.ndarray) -> Labelled:
    """Values of a setting or of a parameter of the model, along their own axis.

    Raises:
        InputError: the model has no such parameter.
    """
    known = SETTINGS | {p.name: (p.unit, p.meaning) for p in (*model.parameters, *model.record_parameters, MASS)}
    if name not in known:
        raise InputError(f"unknown setting {name!r}: expected one of {', '.join(known)}")
    return Labelled((name,), values, *known[name])


def outcome(dims: tuple[str, ...], result: np.ndarray) -> Labelled:
    """Whether each operating point was integrated to its end."""
    return Labelled(dims, result, "1", "0, or the code of why the integration stopped")


def failures(data: xr.Dataset) -> dict[str, int]:
    """Count of operating points by why they stopped short, from the variable `result` of a study; empty where all went through."""
    if "result" not in data:
        return {}
    codes, counts = np.unique(data["result"].values, return_counts=True)
    return {RESULT_MESSAGES[int(code)]: int(count) for code, count in zip(codes, counts, strict=True) if code != SUCCESS}


def labelled(
    title: str,
    model: Model,
    found: Responses,
    *,
    coords: Mapping[str, Labelled],
    variables: Mapping[str, Labelled],
    settings: Mapping[str, Any],
) -> xr.Dataset:
    """The data set of a study.

    Arguments:
        title: of the figure.
        model: that was integrated; written into the provenance as `model.json` has it.
        found: the batch, or the last of several.
        coords: values along each axis.
        variables: what was found.
        settings: the study's own, as JSON can hold them.
    """
    provenance = {
        "title": title,
        "model": json.dumps(model_document(model)),
        "settings": json.dumps(dict(settings)),
        "engine": found.engine,
        "seconds": round(found.seconds, 3),
        "lanes_that_failed": json.dumps(found.failures),
        "vibrojax": __version__,
        "jax": jax.__version__,
    }
    return xr.Dataset({name: _array(part) for name, part in variables.items()}, {n: _array(part) for n, part in coords.items()}, provenance)


def natural_frequency(model: Model, study: str) -> float:
    """f_n of the suspension, Hz.

    Raises:
        InputError: the suspension has none.
    """
    value = model.values().get("f_n")
    if value is None:
        raise InputError(f"{study} needs a natural frequency: the suspension {model.suspension.name!r} has none; use linear or pendulum")
    return float(np.asarray(value))


def setting(data: xr.Dataset, name: str) -> Any:
    """One of the study's settings."""
    return json.loads(data.attrs["settings"])[name]


def _array(part: Labelled) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    return part.dims, np.asarray(part.values), {"units": part.unit, "long_name": part.meaning}
