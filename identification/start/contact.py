"""Contact parameters read off the force-indentation loops, before any integration."""

from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from identification.experiment import Record
from identification.kinematics import Kinematics
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.model import Model

_MOST_SAMPLES = 1500
_MOST_CONTACTS = 1_000_000
_CONTACTS = 30
"""Contacts that are looked at one by one."""
_EXPONENTS = (1.0, 1.5, 2.0, 2.5)


def contact_start(
    model: Model,
    records: list[Record],
    motions: list[Kinematics | None],
    names: tuple[str, ...],
    *,
    load_cell: bool,
    each_contact: bool = False,
) -> tuple[dict[str, float], np.ndarray]:
    """Parameters of the contact law, and each record's gap setting error, m, that best explain force against indentation.

    Every sample in contact gives one equation F = law(u - gap - error, u', v-). No motion is integrated, so this is quick and has no
    trouble with many impacts; smoothing the record biases it by a few per cent, which the fit removes. Empty where there is no contact,
    no load cell to read, or a rigid stop, which has no force.

    Arguments:
        model: with the suspension's first guess in place.
        records: of the experiment.
        motions: smoothed motion of each, None where there is none.
        names: the law's parameters that are to be estimated.
        load_cell: take F from the load cell; otherwise from the hammer's inertia, less the force of the suspension.
        each_contact: give every contact a gap of its own, for a gap that does not hold still; a record's error is then the median.
    """
    errors = np.zeros(len(records))
    samples = _samples(model, records, motions, load_cell)
    if samples is None or not names or not isinstance(model.law, AbstractCompliantLaw):
        return {}, errors
    specs = {p.name: p for p in model.law.parameters}
    if each_contact:
        samples = _some_contacts(samples)
    owner = samples["contact" if each_contact else "record"]
    owners, slot = np.unique(owner, return_inverse=True)
    scale = 0.02 * np.max(samples["force"])
    jacobian: Any
    residual, jacobian = _residual(model, names, samples, slot, scale)
    starts = [_guess(model, specs, names, samples, exponent) for exponent in (_EXPONENTS if "n" in names else (None,))]
    still = np.zeros(len(owners))
    fits = [least_squares(residual, np.concatenate([start, still]), jac=jacobian, loss="soft_l1", max_nfev=60) for start in starts]
    best = min(fits, key=lambda fit: fit.cost)
    values = {name: _bounded(specs[name], best.x[i]) for i, name in enumerate(names)}
    shifts = best.x[len(names) :][slot] * 1e-4
    for record in np.unique(samples["record"]):
        errors[record] = np.median(shifts[samples["record"] == record])
    return values, errors


def _bounded(spec, internal: float) -> float:
    """Physical value, kept inside its range."""
    return float(np.clip(spec.to_physical(np.clip(internal, -40, 40)), max(spec.lower, 1e-3 * spec.start), spec.upper))


def _guess(model: Model, specs, names, samples, exponent: float | None) -> np.ndarray:
    """Start of the regression: the listed orders of magnitude, with the stiffness that gives the median force."""
    values = {name: specs[name].start for name in names}
    if exponent is not None:
        values["n"] = exponent
    if "k_i" in values:
        n = values.get("n", model.values().get("n", 1.0))
        deep = samples["indentation"] > 0.3 * samples["indentation"].max()
        stiffness = float(np.median(samples["force"][deep] / samples["indentation"][deep] ** n))
        values["k_i"] = float(np.clip(stiffness, specs["k_i"].lower, specs["k_i"].upper))  # a wrong unit or sign makes it negative
    return np.array([specs[name].to_internal(values[name]) for name in names])


def _residual(model: Model, names, samples, slot, scale):
    """Function of (internal parameters, gap errors in 0.1 mm) that SciPy minimises, and its derivative, compiled once."""
    specs = [next(p for p in model.law.parameters if p.name == name) for name in names]
    data = {key: jnp.asarray(value) for key, value in samples.items()}
    slot = jnp.asarray(slot)

    def misfit(x):
        values = {p.name: jnp.exp(x[i]) if p.logarithmic else x[i] for i, p in enumerate(specs)}
        delta = data["indentation"] - 1e-4 * x[len(names) :][slot]
        law = cast(AbstractCompliantLaw, model.replace(values).law)
        return (law.force(jnp.maximum(delta, 0.0), data["rate"], data["approach_speed"]) - data["force"]) / scale

    compiled, derivative = jax.jit(misfit), jax.jit(jax.jacfwd(misfit))
    return lambda x: np.asarray(compiled(x)), lambda x: np.asarray(derivative(x))


def _some_contacts(samples: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The samples of a fair selection of the contacts."""
    contacts = np.unique(samples["contact"])
    chosen = contacts[np.unique(np.linspace(0, len(contacts) - 1, min(len(contacts), _CONTACTS)).astype(int))]
    keep = np.isin(samples["contact"], chosen)
    return {name: values[keep] for name, values in samples.items()}


def _samples(model: Model, records: list[Record], motions: list[Kinematics | None], load_cell: bool) -> dict[str, np.ndarray] | None:
    """Force, indentation, its rate, approach speed and record of (a fair selection of) all samples in contact."""
    parts = []
    for index, (record, motion) in enumerate(zip(records, motions, strict=True)):
        if motion is None or not motion.touching.any():
            continue
        u, v, base = (jnp.asarray(values) for values in (motion.u, motion.v, motion.base_acceleration))
        free = np.asarray(model.suspension.acceleration(u, v, -base) + base)
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
