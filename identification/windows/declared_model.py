"""Nominal model of an experiment, as declared before any fit."""

import math
from typing import Any

from identification.experiment import Experiment, ExperimentError
from vibrojax.contact import LAWS, AbstractContactLaw, AbstractInstantaneousLaw
from vibrojax.errors import InputError
from vibrojax.load import Load
from vibrojax.model import Model
from vibrojax.suspension import SUSPENSIONS

DEFAULT_LAW = "hunt-crossley"


def nominal_model(experiment: Experiment, law: str | None) -> Model:
    """Nominal model that the experiment names, with every parameter at its start value."""
    name = law or experiment.law or DEFAULT_LAW
    if name not in LAWS:
        raise ExperimentError(f"unknown contact law {name!r}: expected one of {', '.join(LAWS)}")
    felt = [record.file for record in experiment.records if "impact_force" in record.channels]
    if issubclass(LAWS[name], AbstractInstantaneousLaw) and felt:
        raise ExperimentError(
            f"the stop of law {name!r} pushes for no time, and {felt[0]} holds an impact_force: expected records without one; remove "
            "[sensors.impact_force], or choose another law"
        )
    kind = SUSPENSIONS[experiment.suspension.kind]
    geometry: dict[str, Any] = {} if experiment.suspension.length is None else {"length": experiment.suspension.length}
    numbers: dict[str, Any] = {p.field: p.start for p in (*kind.parameters, *LAWS[name].parameters)}
    return Model(
        mass=experiment.mass,
        suspension=kind(**{p.field: numbers[p.field] for p in kind.parameters}, **geometry),
        law=LAWS[name](**{p.field: numbers[p.field] for p in LAWS[name].parameters}),
        load=Load(incline=experiment.load.incline, constant_force=experiment.load.constant_force),
    )


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
