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
from vibrojax.effects import AbstractEffect
from vibrojax.model import Model

_MOST_SAMPLES = 1500
_MOST_CONTACTS = 1_000_000
_OWNERS = 30
"""Contacts, or records, whose gaps are estimated beside the law; of more, an even selection."""
_EXPONENTS = (1.0, 1.5, 2.0, 2.5)
_DEEP, _DEEP_BESIDE = 0.3, 0.6
"""Over the largest indentation: depth above which samples give the stiffness; upper limit beside an effect that changes the law."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Loops:
    """Regression of the force-indentation loops: contact parameters, gap errors, and the fitted samples."""

    values: dict[str, float]
    """Parameters by name, SI."""
    errors: np.ndarray
    """(records,) setting error of the gap, m."""
    cost: float
    """Mean robust loss per sample (soft L1, half squared for small errors), with forces in fiftieths of the largest one."""
    record: np.ndarray
    """(samples,) index of each sample's record."""
    contact: np.ndarray
    """(samples,) number of each sample's contact, unique over all records."""
    indentation: np.ndarray
    """(samples,) m, corrected for the gap errors."""
    force: np.ndarray
    """(samples,) of the load cell, or of the hammer's inertia, N."""
    modelled: np.ndarray
    """(samples,) of the fitted law, N."""


def contact_start(
    model: Model,
    records: list[Record],
    motions: list[Kinematics | None],
    names: tuple[str, ...],
    *,
    load_cell: bool,
    each_contact: bool = False,
    probes: tuple[AbstractEffect, ...] = (),
) -> Loops | None:
    """Contact parameters and gap setting errors from a least-squares regression of force on indentation.

    Every sample in contact gives one equation F = law(u - gap - error, u', v-). No motion is integrated, so the regression is fast and does
    not depend on the number of impacts; smoothing of the record biases it by a few per cent, which the fit removes. None where there is no
    contact, no load cell to read, a rigid stop, which has no force, or no start with a finite force.

    Arguments:
        model: with the suspension's first guess in place; its effects do not matter.
        records: of the experiment.
        motions: smoothed motion of each, None where there is none.
        names: the law's parameters that are to be estimated.
        load_cell: take F from the load cell; otherwise from the hammer's inertia, less the force of the suspension.
        each_contact: give every contact its own gap, for a gap that varies between contacts; a record's error is then the median.
        probes: start values of an effect that changes the law, whose parameters are estimated as well.
    """
    samples = _samples(model, records, motions, load_cell)
    if samples is None or not names or not isinstance(model.law, AbstractCompliantLaw):
        return None
    owner = "contact" if each_contact else "record"
    samples = _of_some(samples, owner)
    owners, slot = np.unique(samples[owner], return_inverse=True)
    still = np.zeros(len(owners))
    fits = []
    for effects in [(probe,) for probe in probes] or [()]:
        changed = dataclasses.replace(model, effects=effects)
        specs = {p.name: p for p in changed.parameters}
        wanted = (*names, *(p.name for p in changed.parameters if "." in p.name))
        residual, jacobian = _residual(changed, wanted, samples, slot)
        for exponent in _EXPONENTS if "n" in names else (None,):
            start = np.concatenate([_guess(changed, specs, wanted, samples, exponent), still])
            fit = _fitted(residual, jacobian, start)
            if fit is not None:
                values = {name: _bounded(specs[name], fit.x[i]) for i, name in enumerate(wanted)}
                fits.append((float(fit.cost) / len(samples["force"]), values, fit.x[len(wanted) :], fit.fun))
    if not fits:
        return None
    cost, values, shifts, off = min(fits, key=lambda fit: fit[0])
    shifts, errors = _length(samples) * shifts[slot], np.zeros(len(records))
    for record in np.unique(samples["record"]):
        errors[record] = np.median(shifts[samples["record"] == record])
    return Loops(
        values=values,
        errors=errors,
        cost=cost,
        record=samples["record"],
        contact=samples["contact"],
        indentation=samples["indentation"] - shifts,
        force=samples["force"],
        modelled=samples["force"] + _scale(samples) * off,
    )


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
    """Start of the regression: listed start values, with the stiffness that gives the median force; effects unchanged."""
    values = {name: float(model.values()[name]) if "." in name else specs[name].start for name in names}
    if exponent is not None:
        values["n"] = exponent
    if "k_i" in values:
        n = values.get("n", model.values().get("n", 1.0))
        depth = samples["indentation"] / samples["indentation"].max()
        deep = depth > _DEEP
        if model.effects and (deep & (depth < _DEEP_BESIDE)).any():
            deep &= depth < _DEEP_BESIDE
        stiffness = float(np.median(samples["force"][deep] / samples["indentation"][deep] ** n))
        values["k_i"] = float(np.clip(stiffness, specs["k_i"].lower, specs["k_i"].upper))  # negative for a wrong unit or sign
    return np.array([specs[name].to_internal(values[name]) for name in names])


def _residual(model: Model, names, samples, slot):
    """Residual as a function of (internal parameters, gap errors over `_length`) for SciPy, and its Jacobian."""
    data = {key: jnp.asarray(value) for key, value in samples.items()}
    units = jnp.asarray([_length(samples), _scale(samples)])
    given = (jax.tree.map(jnp.asarray, model), tuple(names), data, jnp.asarray(slot), units)
    return lambda x: np.asarray(_misfit(*given, jnp.asarray(x))), lambda x: np.asarray(_misfit_slope(*given, jnp.asarray(x)))


def _off(model: Model, names: tuple[str, ...], data, slot, units, x):
    specs = {p.name: p for p in model.parameters}
    changed = model.replace({name: jnp.exp(x[i]) if specs[name].logarithmic else x[i] for i, name in enumerate(names)})
    delta, law = data["indentation"] - units[0] * x[len(names) :][slot], changed.law
    for effect in changed.effects:
        law, _ = effect.stop(law, 0.0)
    force = cast(AbstractCompliantLaw, law).force(jnp.maximum(delta, 0.0), data["rate"], data["approach_speed"])
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


def _of_some(samples: dict[str, np.ndarray], owner: str) -> dict[str, np.ndarray]:
    """Samples of an even selection of the contacts, or of the records."""
    owners = np.unique(samples[owner])
    chosen = owners[np.unique(np.linspace(0, len(owners) - 1, min(len(owners), _OWNERS)).astype(int))]
    keep = np.isin(samples[owner], chosen)
    return {name: values[keep] for name, values in samples.items()}


@soon_compiled
def _in_flight(model: Model, u, v, base):
    """Absolute acceleration of the hammer without contact, m/s^2."""
    return model.suspension.acceleration(u, v, model.load.force(model.mass) / model.mass - base) + base


def _samples(model: Model, records: list[Record], motions: list[Kinematics | None], load_cell: bool) -> dict[str, np.ndarray] | None:
    """Force, indentation, its rate, approach speed and record of (an even selection of) all samples in contact."""
    parts = []
    for index, (record, motion) in enumerate(zip(records, motions, strict=True)):
        if motion is None or not motion.touching.any():
            continue
        u, v, base = (jnp.asarray(values) for values in (motion.u, motion.v, motion.base_acceleration))
        free = np.asarray(_in_flight(jax.tree.map(jnp.asarray, model), u, v, base))
        force = motion.force if load_cell else motion.inertia + model.mass * free
        if force is None:
            continue
        begins = motion.touching & ~np.concatenate([[False], motion.touching[:-1]])
        last_touch = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
        approach = np.maximum(np.abs(motion.v[np.maximum(last_touch - 1, 0)]), 1e-3)
        keep = motion.touching & (motion.u > record.gap)
        parts.append(
            np.stack(
                [
                    force[keep],
                    motion.u[keep] - record.gap,
                    motion.v[keep],
                    approach[keep],
                    np.full(keep.sum(), float(index)),
                    _MOST_CONTACTS * index + np.cumsum(begins)[keep],
                ]
            )
        )
    if not parts or sum(part.shape[1] for part in parts) < 10:
        return None
    force, indentation, rate, approach, owner, contact = np.concatenate(parts, axis=1)
    chosen = np.unique(np.linspace(0, len(force) - 1, min(len(force), _MOST_SAMPLES)).astype(int))
    return {
        "force": force[chosen],
        "indentation": indentation[chosen],
        "rate": rate[chosen],
        "approach_speed": approach[chosen],
        "record": owner[chosen].astype(int),
        "contact": contact[chosen].astype(int),
    }
