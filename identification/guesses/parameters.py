"""First guesses of all parameters; those of the contact from a regression of the force-indentation loops, before any integration."""

import dataclasses
from collections.abc import Callable, Iterable
from itertools import product
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from identification.experiment import Experiment, Record
from identification.guesses.motion import Kinematics
from identification.guesses.suspension import prescribed_start, suspension_start
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import AbstractEffect
from vibrojax.model import MASS, Model

_RECORDS = 30
"""Records whose gaps are estimated beside the law; of more, an even selection."""


GAP_PRIOR_STD_M = 1e-3
"""Prior standard deviation of the gap's setting error, m."""


def first_guesses(experiment: Experiment, model: Model, motions: list[Kinematics | None]) -> tuple[dict[str, float], np.ndarray]:
    """Every shared parameter by name, and the gap errors of the records, m.

    A parameter takes the operator's value if given, else that of the data, else its start value. The contact is read off the load cell, or
    off the hammer's inertia where there is no cell, or where the cell asks for gaps that an operator does not set: one whose time constant
    exceeds the impact shows the stop millimetres away.
    """
    records = list(experiment.records)
    wanted = {name: option.start for name, option in experiment.parameters.items() if option.start is not None}
    suspension, mass = suspension_start(records, motions, mass=experiment.mass if experiment.mass_is_known else None, load=experiment.load)
    suspension = suspension or prescribed_start(records, motions, mass=experiment.mass)
    listed = {p.name: p for p in model.suspension.parameters}
    values = {name: float(value) for name, value in model.values().items()}
    values |= {name: float(np.clip(value, listed[name].lower, listed[name].upper)) for name, value in suspension.items() if name in listed}
    if not experiment.mass_is_known:
        values[MASS.name] = mass if mass is not None else experiment.mass
    values |= wanted
    model = model.replace(values)
    free = tuple(p.name for p in model.law.parameters if p.name not in wanted)
    read = likelier_start(model, records, motions, free)
    return (values, np.zeros(len(records))) if read is None else (values | read.values, read.gap_errors)


Effects = Callable[[float, float], Iterable[AbstractEffect]]
"""From the largest indentation, m, and force, N, an effect that changes the stop, at several strengths."""


class Loops(NamedTuple):
    """Contact read off the loops of force over indentation.

    Attributes:
        values: of parameters by name, SI.
        gap_errors: setting errors of the gaps, m, (records,).
        misfit: sum of squared errors of the force, those far off counted less, relative to 2 % of its largest value.
        load_cell: whether the force is that of the load cell, not of the hammer's inertia.
    """

    values: dict[str, float]
    gap_errors: Float[np.ndarray, " records"]
    misfit: float
    load_cell: bool


def likelier_start(
    model: Model, records: list[Record], motions: list[Kinematics | None], names: tuple[str, ...], effects: Effects | None = None
) -> Loops | None:
    """`contact_start` off the load cell, or off inertia where there is none or where the gaps that the cell asks for are unlikely."""
    cell, inertia = (contact_start(model, records, motions, names, load_cell=one, effects=effects) for one in (True, False))
    if cell is None or inertia is None:
        return cell or inertia
    unlikely = np.sum(cell.gap_errors**2 - inertia.gap_errors**2) > (2.0 * GAP_PRIOR_STD_M) ** 2  # by two standard deviations
    return inertia if unlikely else cell


def contact_start(
    model: Model,
    records: list[Record],
    motions: list[Kinematics | None],
    names: tuple[str, ...],
    *,
    load_cell: bool,
    effects: Effects | None = None,
) -> Loops | None:
    """Contact parameters and setting errors of the gaps, by least squares of force on indentation.

    Every sample in contact gives one equation F = law(u - gap - error, u', v-). No motion is integrated, so the regression is fast and does
    not depend on the number of impacts; smoothing of the record biases it by a few per cent, which the fit removes. None where there is no
    contact, no load cell to read, a rigid stop, which has no force, or no start with a finite force.

    Arguments:
        model: with the suspension's first guess in place.
        records: of the experiment.
        motions: smoothed motion of each, None where there is none.
        names: parameters of the law, and of effects that change it, that are to be estimated.
        load_cell: take F from the load cell; otherwise from the hammer's inertia, less the force of the suspension.
        effects: beside those of the model, at the strengths to begin from; none by default.
    """
    samples = _samples(model, records, motions, load_cell)
    if samples is None or not names:
        return None
    begun = [model]
    if effects is not None:
        most = [max(float(np.max(samples[name])), 0.0) for name in ("indentation", "force")]
        begun = [dataclasses.replace(model, effects=(*model.effects, one)) for one in effects(*most)]
    if not begun or not isinstance(begun[0].stop(0.0)[0], AbstractCompliantLaw):
        return None
    owners, slot = np.unique(samples.pop("record"), return_inverse=True)
    units = np.array([0.1 * np.max(samples["indentation"]), 0.02 * np.max(samples["force"])])  # of gap errors, m, and of forces, N
    specs, fits = {p.name: p for p in begun[0].parameters}, []
    # depth over the largest indentation where samples give the stiffness: the shallow part where an effect may act on the deep one
    depths = ((0.3, 1.0), (0.03, 0.3))[: 2 if effects is not None and "k_i" in names else 1]
    for model, exponent, part in product(begun, (1.0, 1.5, 2.0, 2.5) if "n" in names else (None,), depths):
        given = (jax.tree.map(np.asarray, model), names, samples, slot, units)
        start = np.concatenate([_guess(model, specs, names, samples, exponent, part), np.zeros(_RECORDS)])
        programs: list[Any] = [lambda x, one=one, given=given: np.asarray(one(*given, x)) for one in (_misfit, _misfit_slope)]
        residual, slope = programs
        if not (np.isfinite(residual(start)).all() and np.isfinite(slope(start)).all()):
            continue
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                fits.append(least_squares(residual, start, jac=slope, loss="soft_l1", max_nfev=60))
        except (ValueError, np.linalg.LinAlgError):  # the force is not finite further on
            continue
    if not fits:
        return None
    least = min(fits, key=lambda fit: float(fit.cost))
    best = least.x
    values, errors = {}, np.zeros(len(records))
    for name, internal in zip(names, best[: len(names)], strict=True):
        spec = specs[name]
        values[name] = float(np.clip(spec.to_physical(np.clip(internal, -40, 40)), max(spec.lower, 1e-3 * spec.start), spec.upper))
    errors[owners] = units[0] * best[len(names) : len(names) + len(owners)]
    return Loops(values, errors, 2.0 * float(least.cost), load_cell)


def _guess(model: Model, specs, names, samples, exponent: float | None, part: tuple[float, float]) -> np.ndarray:
    """Start of the regression: listed values, those that effects have, and the stiffness of the median force in a part of the depth."""
    law = {p.name for p in model.law.parameters}
    values = {name: specs[name].start if name in law else float(model.values()[name]) for name in names}
    if exponent is not None:
        values["n"] = exponent
    if "k_i" in values:
        n = values.get("n", model.values().get("n", 1.0))
        depth = samples["indentation"] / samples["indentation"].max()
        there = (depth > part[0]) & (depth <= part[1])
        stiffness = float(np.median(samples["force"][there] / samples["indentation"][there] ** n)) if there.any() else specs["k_i"].start
        values["k_i"] = float(np.clip(stiffness, specs["k_i"].lower, specs["k_i"].upper))  # negative for a wrong unit or sign
    return np.array([specs[name].to_internal(values[name]) for name in names])


def _scaled_misfit(model: Model, names: tuple[str, ...], samples, slot, units, x):
    """Error of the law's force at every sample over its unit, of internal parameters and gap errors over theirs."""
    specs = {p.name: p for p in model.parameters}
    changed = model.replace({name: jnp.exp(x[i]) if specs[name].logarithmic else x[i] for i, name in enumerate(names)})
    delta = samples["indentation"] - units[0] * x[len(names) :][slot]
    law, beyond = changed.stop(0.0)
    force = cast(AbstractCompliantLaw, law).force(jnp.maximum(delta - beyond, 0.0), samples["rate"], samples["approach_speed"])
    return (force - samples["force"]) / units[1]


_misfit = soon_compiled(_scaled_misfit)


@soon_compiled
def _misfit_slope(model: Model, names: tuple[str, ...], samples, slot, units, x):
    return jax.jacfwd(lambda moved: _scaled_misfit(model, names, samples, slot, units, moved))(x)


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
    chosen = np.linspace(0, found.shape[1] - 1, 1500).astype(int)  # as many of any records, so that the regression is compiled once
    force, u, v, base, approach, gap, owner = found[:, chosen]
    if not load_cell:
        force = force + model.mass * np.asarray(_in_flight(jax.tree.map(np.asarray, model), u, v, base))
    return {"force": force, "indentation": u - gap, "rate": v, "approach_speed": approach, "record": owner.astype(int)}
