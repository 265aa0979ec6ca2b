"""Contact parameters from a regression of the force-indentation loops, before any integration."""

import dataclasses
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from identification.experiment import Record
from identification.windows.kinematics import Kinematics
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.model import Model

_SAMPLES = 1500
"""Of the regression, whatever the records hold, so that it is compiled once."""
_RECORDS = 30
"""Records whose gaps are estimated beside the law; of more, an even selection."""
_EXPONENTS = (1.0, 1.5, 2.0, 2.5)
_DEEP = 0.3
"""Depth over the largest indentation above which samples give the stiffness."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Loops:
    """Regression of the force-indentation loops: parameters of the law by name, SI, and setting error of the gap, m, (records,)."""

    values: dict[str, float]
    errors: np.ndarray


def contact_start(
    model: Model, records: list[Record], motions: list[Kinematics | None], names: tuple[str, ...], *, load_cell: bool
) -> Loops | None:
    """Contact parameters and gap setting errors from a least-squares regression of force on indentation.

    Every sample in contact gives one equation F = law(u - gap - error, u', v-). No motion is integrated, so the regression is fast and does
    not depend on the number of impacts; smoothing of the record biases it by a few per cent, which the fit removes. None where there is no
    contact, no load cell to read, a rigid stop, which has no force, or no start with a finite force.

    Arguments:
        model: with the suspension's first guess in place.
        records: of the experiment.
        motions: smoothed motion of each, None where there is none.
        names: the law's parameters that are to be estimated.
        load_cell: take F from the load cell; otherwise from the hammer's inertia, less the force of the suspension.
    """
    samples = _samples(model, records, motions, load_cell)
    if samples is None or not names or not isinstance(model.law, AbstractCompliantLaw):
        return None
    owners, slot = np.unique(samples["record"], return_inverse=True)
    specs = {p.name: p for p in model.parameters}
    residual, jacobian = _residual(model, names, samples, slot)
    fits = []
    for exponent in _EXPONENTS if "n" in names else (None,):
        start = np.concatenate([_guess(model, specs, names, samples, exponent), np.zeros(_RECORDS)])
        fit = _fitted(residual, jacobian, start)
        if fit is not None:
            values = {name: _bounded(specs[name], fit.x[i]) for i, name in enumerate(names)}
            fits.append((float(fit.cost), values, fit.x[len(names) :]))
    if not fits:
        return None
    _, values, shifts = min(fits, key=lambda fit: fit[0])
    errors = np.zeros(len(records))
    errors[owners.astype(int)] = _length(samples) * shifts[: len(owners)]
    return Loops(values=values, errors=errors)


def _fitted(residual, jacobian, start: np.ndarray) -> Any | None:
    """One regression; None where the law's force is not finite at or after its start."""
    if not (np.isfinite(residual(start)).all() and np.isfinite(jacobian(start)).all()):
        return None
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return least_squares(residual, start, jac=jacobian, loss="soft_l1", max_nfev=60)
    except (ValueError, np.linalg.LinAlgError):
        return None


def _bounded(spec, internal: float) -> float:
    """Physical value of a parameter, clipped to its range."""
    return float(np.clip(spec.to_physical(np.clip(internal, -40, 40)), max(spec.lower, 1e-3 * spec.start), spec.upper))


def _guess(model: Model, specs, names, samples, exponent: float | None) -> np.ndarray:
    """Start of the regression: listed start values, with the stiffness that gives the median force."""
    values = {name: specs[name].start for name in names}
    if exponent is not None:
        values["n"] = exponent
    if "k_i" in values:
        n = values.get("n", model.values().get("n", 1.0))
        deep = samples["indentation"] > _DEEP * samples["indentation"].max()
        stiffness = float(np.median(samples["force"][deep] / samples["indentation"][deep] ** n))
        values["k_i"] = float(np.clip(stiffness, specs["k_i"].lower, specs["k_i"].upper))  # negative for a wrong unit or sign
    return np.array([specs[name].to_internal(values[name]) for name in names])


def _residual(model: Model, names, samples, slot):
    """Residual as a function of (internal parameters, gap errors over `_length`) for SciPy, and its Jacobian."""
    units = np.array([_length(samples), _scale(samples)])
    given = (jax.tree.map(np.asarray, model), tuple(names), samples, slot, units)
    return lambda x: np.asarray(_misfit(*given, x)), lambda x: np.asarray(_misfit_slope(*given, x))


def _off(model: Model, names: tuple[str, ...], data, slot, units, x):
    specs = {p.name: p for p in model.parameters}
    changed = model.replace({name: jnp.exp(x[i]) if specs[name].logarithmic else x[i] for i, name in enumerate(names)})
    delta = data["indentation"] - units[0] * x[len(names) :][slot]
    force = cast(AbstractCompliantLaw, changed.law).force(jnp.maximum(delta, 0.0), data["rate"], data["approach_speed"])
    return (force - data["force"]) / units[1]


_misfit = soon_compiled(_off)


@soon_compiled
def _misfit_slope(model: Model, names: tuple[str, ...], data, slot, units, x):
    return jax.jacfwd(lambda moved: _off(model, names, data, slot, units, moved))(x)


def _length(samples: dict[str, np.ndarray]) -> float:
    """Unit of the gap errors, m: a tenth of the largest indentation."""
    return 0.1 * float(np.max(samples["indentation"]))


def _scale(samples: dict[str, np.ndarray]) -> float:
    """Unit of the force errors, N: a fiftieth of the largest force."""
    return 0.02 * float(np.max(samples["force"]))


@soon_compiled
def _in_flight(model: Model, u, v, base):
    """Absolute acceleration of the hammer without contact, m/s^2."""
    return model.suspension.acceleration(u, v, model.load.force(model.mass) / model.mass - base) + base


def _samples(model: Model, records: list[Record], motions: list[Kinematics | None], load_cell: bool) -> dict[str, np.ndarray] | None:
    """Force, indentation, its rate, approach speed and record of samples in contact, evenly chosen, of `_RECORDS` records at most."""
    parts = []
    for index, (record, motion) in enumerate(zip(records, motions, strict=True)):
        if motion is None or not motion.touching.any():
            continue
        force = motion.force if load_cell else motion.inertia
        if force is None:
            continue
        begins = motion.touching & ~np.concatenate([[False], motion.touching[:-1]])
        last_touch = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
        approach = np.maximum(np.abs(motion.v[np.maximum(last_touch - 1, 0)]), 1e-3)
        keep = motion.touching & (motion.u > record.gap)
        given = np.full(keep.sum(), record.gap), np.full(keep.sum(), float(index))
        parts.append(np.stack([force[keep], motion.u[keep], motion.v[keep], motion.base_acceleration[keep], approach[keep], *given]))
    if not parts or sum(part.shape[1] for part in parts) < 10:
        return None
    some = np.unique(np.linspace(0, len(parts) - 1, min(len(parts), _RECORDS)).astype(int))
    found = np.concatenate([parts[index] for index in some], axis=1)
    force, u, v, base, approach, gap, owner = found[:, np.linspace(0, found.shape[1] - 1, _SAMPLES).astype(int)]
    if not load_cell:
        force = force + model.mass * np.asarray(_in_flight(jax.tree.map(np.asarray, model), u, v, base))
    return {"force": force, "indentation": u - gap, "rate": v, "approach_speed": approach, "record": owner.astype(int)}
