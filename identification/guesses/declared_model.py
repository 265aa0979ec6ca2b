"""What an experiment declares before any fit: its nominal model, the operator's wishes for single parameters, and its gaps."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from identification.experiment import Experiment, ExperimentError
from identification.experiment.channels import STRUCK
from identification.experiment.errors import suggestion
from identification.guesses.motion import relative_displacement
from vibrojax.contact import LAWS, AbstractContactLaw, AbstractInstantaneousLaw, NoContact
from vibrojax.effects.filters import RecorderFilter
from vibrojax.errors import InputError
from vibrojax.model import Load, Model
from vibrojax.parameters import Parameter
from vibrojax.suspension import SUSPENSIONS


def check_precision() -> None:
    """Raise `InputError` unless JAX computes in double precision."""
    if jnp.result_type(float) != jnp.float64:
        raise InputError('JAX computes in single precision: expected float64; call jax.config.update("jax_enable_x64", True) first')


def nominal_model(experiment: Experiment, law: str | None) -> Model:
    """Nominal model that the experiment names, with every parameter at its start value."""
    name = law or experiment.law or "hunt-crossley"
    check_law(name)
    felt = [record.file for record in experiment.records if "impact_force" in record.channels]
    if issubclass(LAWS[name], AbstractInstantaneousLaw) and felt:
        raise ExperimentError(
            f"the stop of law {name!r} pushes for no time, and {felt[0]} holds an impact_force: expected records without one; remove "
            "[sensors.impact_force], or choose another law"
        )
    kind = SUSPENSIONS[experiment.suspension.kind]
    geometry: dict[str, Any] = {} if experiment.suspension.length is None else {"length": experiment.suspension.length}
    numbers: dict[str, Any] = {p.field: p.start for p in (*kind.parameters, *LAWS[name].parameters)}
    recorded = {channel for record in experiment.records for channel in record.channels}
    return Model(
        mass=experiment.mass,
        suspension=kind(**{p.field: numbers[p.field] for p in kind.parameters}, **geometry),
        law=LAWS[name](**{p.field: numbers[p.field] for p in LAWS[name].parameters}),
        load=Load(incline=experiment.load.incline, constant_force=experiment.load.constant_force),
        recorder=tuple(
            RecorderFilter(of_channel=one.channel, band=one.band, order=one.order, corner_hz=one.corner)
            for one in experiment.filters
            if one.channel in recorded
        ),
    )


def check_laws(names: Sequence[str]) -> None:
    """Raise `ExperimentError` unless these are the names of two or more contact laws, for a comparison."""
    for name in names:
        check_law(name)
    if len(set(names)) < 2:
        raise ExperimentError(f"{', '.join(names)} is one contact law: expected two or more to compare, of {', '.join(LAWS)}")


def check_compared_wishes(experiment: Experiment, laws: Sequence[str]) -> None:
    """Refuse a comparison of laws in which a number that [parameters] gives has different units, the experiment's own law among them.

    Raises:
        ExperimentError: there is such a number; the message names parameter, laws and units.
    """
    meant = tuple(dict.fromkeys((*((experiment.law,) if experiment.law else ()), *laws)))
    for name in meant:
        check_law(name)
    for name, option in experiment.parameters.items():
        if option.start is None and option.bounds is None and option.prior is None:
            continue
        units = {law: p.unit for law in meant for p in LAWS[law].parameters if p.name == name}
        first = next(iter(units), "")
        for law, unit in units.items():
            if unit != units[first]:
                raise ExperimentError(
                    f"[parameters.{name}] is in {units[first]} for {first}, and {law} has {name} in {unit}: expected laws of one unit; "
                    f"leave {law} out of the comparison, or the numbers in [parameters.{name}]"
                )


def check_law(name: str) -> None:
    """Raise `ExperimentError` unless this is the name of a contact law."""
    if name not in LAWS:
        raise ExperimentError(f"unknown contact law {name!r}: expected one of {', '.join(LAWS)}")


def check_smoothing(law: AbstractContactLaw, width: float | None) -> None:
    """Refuse a width of the contact switch, m, that is no length, and one for a stop without a force."""
    if width is None:
        return
    if not 0.0 < width < math.inf:
        raise InputError(f"the width of the smoothed contact is {width:g} m: expected a length above 0, short against the indentation")
    if isinstance(law, AbstractInstantaneousLaw):
        raise InputError(
            f"the stop of law {law.name!r} is rigid, so it has no force to smooth: expected the landing integrator, or another law"
        )


def check_wishes(experiment: Experiment, parameters: tuple[Parameter, ...]) -> None:
    """Raise `ExperimentError` where a wish names no parameter of the model, or values that it cannot have."""
    listed = {p.name: p for p in parameters}
    for name, option in experiment.parameters.items():
        if name not in listed:
            raise ExperimentError(f"unknown parameter {name!r} in [parameters]{suggestion(name, listed)}")
        p, where = listed[name], f"[parameters.{name}]"
        for end in option.bounds or ():
            refusal = p.refusal(end) or ("a number above 0" if p.logarithmic and end <= 0.0 else "")
            if refusal:
                raise ExperimentError(f"bounds in {where} reach to {end:g}: expected {refusal}; correct them")
        low, high = option.bounds or (p.lower, p.upper)
        unit = "" if p.unit == "1" else f" {p.unit}"
        for what, value in {"start": option.start, "mean of the prior": option.prior and option.prior.mean}.items():
            if value is not None and not low <= value <= high:
                raise ExperimentError(f"{what} of {name} in [parameters] is {value:g}: expected {low:g} to {high:g}{unit}; correct it")
        if option.varies and len(experiment.records) < 2:
            raise ExperimentError(f"{where} varies between records, and one is fitted: expected two or more; remove 'varies'")


def within_bounds(experiment: Experiment, parameters: Iterable[Parameter]) -> tuple[Parameter, ...]:
    """The parameters with the operator's bounds in place of their usual range."""
    limits = {name: option.bounds for name, option in experiment.parameters.items() if option.bounds is not None}
    return tuple(dataclasses.replace(p, lower=limits[p.name][0], upper=limits[p.name][1]) if p.name in limits else p for p in parameters)


def priors(experiment: Experiment) -> tuple[tuple[str, float, float], ...]:
    """Name, mean and standard deviation, SI, of every parameter with a prior."""
    return tuple((name, one.prior.mean, one.prior.std) for name, one in experiment.parameters.items() if one.prior is not None)


def varying(experiment: Experiment) -> tuple[str, ...]:
    """Names of the parameters that have a value of their own in every record."""
    return tuple(name for name, option in experiment.parameters.items() if option.varies)


def check_clearance(experiment: Experiment, law: AbstractContactLaw) -> None:
    """Check every gap against the recorded motion, in held-back records too.

    A displacement with an unknown zero does not identify its gap and is not checked.

    Raises:
        ExperimentError: from first to last sample the hammer is far beyond the stated position of the stop.
    """
    offset = any(sensor.zero is not None for channel, sensor in experiment.sensors.items() if channel.endswith("displacement"))
    if offset or isinstance(law, NoContact):
        return
    for record in experiment.records:
        u = relative_displacement(record)
        # an indentation of ten times the hammer's own travel, and of ten times an error of setting the gap that is already large, 1 mm
        if record.kind in STRUCK and u is not None and u.min() - record.gap > max(10.0 * np.ptp(u), 0.01):
            raise ExperimentError(
                f"gap of record {record.file!r} is {record.gap:g} m, and its hammer stays between {u.min():.4g} m and {u.max():.4g} m:"
                " expected that it leaves the stop; check sign and unit of the gap, or, for a sensor with an offset, set its zero"
            )
