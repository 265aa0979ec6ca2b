"""What every study hands back: the kind of each motion, and an xarray data set with units and provenance.

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
from vibrojax.batch.points import section_scales
from vibrojax.batch.run import repeats
from vibrojax.errors import InputError
from vibrojax.integrate.base import SUCCESS
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


def assigned(data: xr.Dataset, variables: Mapping[str, Labelled]) -> xr.Dataset:
    """The study with further variables."""
    return data.assign({name: _array(part) for name, part in variables.items()})


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


NO_IMPACT, PERIODIC, APERIODIC, FAILED = 0, 1, 2, 3
KINDS = {NO_IMPACT: "no impact", PERIODIC: "periodic impacts", APERIODIC: "aperiodic impacts", FAILED: "not integrated"}
LONGEST = 8
"""Cycles; an orbit of a longer period counts as aperiodic."""


ALIKE = 1e-5
"""Two strobes closer than this part of A0, and of A0 Omega in velocity, are the same."""


class Kind(NamedTuple):
    """Shaped like the axes of the batch."""

    kind: np.ndarray
    """A key of `KINDS`."""
    impacts: np.ndarray
    """p of z = p/q: impacts in one period of the motion; 0 where there is none."""
    period: np.ndarray
    """q of z = p/q: cycles of excitation in one period; 0 where none up to `LONGEST` is seen."""


def classify(found: Responses, base_amplitude: float | np.ndarray, frequency_hz: np.ndarray) -> Kind:
    """Kind of motion from the recorded cycles.

    Arguments:
        found: the batch; periods up to half of its recorded cycles can be seen.
        base_amplitude: A0, m, broadcasting to the axes.
        frequency_hz: of the excitation, broadcasting to the axes.
    """
    shape, cycles = found.result.shape, found.u.shape[-1]
    u, v, hits, force = (part.reshape(-1, cycles).T for part in (found.u, found.v, found.impacts, found.peak_force))
    scale = section_scales(*(np.broadcast_to(part, shape).reshape(-1) for part in (base_amplitude, frequency_hz)))
    period = repeats(np.stack([u, v], axis=1), scale, ALIKE, LONGEST)
    back = np.arange(cycles)[::-1, None] < period[None, :]
    impacts = np.sum(np.where(back, hits, 0), axis=0)
    quiet = (hits.sum(axis=0) == 0) & (force.max(axis=0) == 0)
    kind = np.where(quiet, NO_IMPACT, np.where(period > 0, PERIODIC, APERIODIC))
    kind = np.where(found.result.reshape(-1) == SUCCESS, kind, FAILED)
    return Kind(kind.reshape(shape), impacts.reshape(shape), period.reshape(shape))


def code(impacts: int, period: int) -> int:
    """One number for a motion z = p/q with impacts; 0 is that of rest, all motions without."""
    return 1000 * impacts + period if impacts else 0


def codes(kind: np.ndarray, impacts: np.ndarray, period: np.ndarray, *, other: int = -1) -> np.ndarray:
    """`code` of each motion; `other` where it is neither periodic nor without impacts."""
    return np.where(kind == PERIODIC, 1000 * impacts + period, np.where(kind == NO_IMPACT, 0, other))


def outcome(dims: tuple[str, ...], result: np.ndarray) -> dict[str, Labelled]:
    """Whether each operating point was integrated to its end, as a variable of a study."""
    return {"result": Labelled(dims, result, "1", "0, or the code of why the integration stopped")}


def motions(dims: tuple[str, ...], kind: Kind, result: np.ndarray) -> dict[str, Labelled]:
    """The motion of each operating point as variables of a study."""
    return {
        "kind": Labelled(dims, kind.kind, "1", "kind of motion: " + ", ".join(f"{code} {words}" for code, words in KINDS.items())),
        "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
        "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
        **outcome(dims, result),
    }


def forces(dims: tuple[str, ...], force: np.ndarray, mass: float | np.ndarray) -> dict[str, Labelled]:
    """The largest impact force of each operating point as variables of a study."""
    return {
        "impact_force": Labelled(dims, force, "N", "largest impact force"),
        "force_over_weight": Labelled(dims, force / (GRAVITY * mass), "1", "largest impact force over the hammer's weight"),
    }
