"""The nominal model of an experiment: what the operator believes before any fit."""

from typing import Any

from identification.experiment import Experiment, ExperimentError
from vibrojax.contact import LAWS
from vibrojax.model import Model
from vibrojax.suspension import SUSPENSIONS

DEFAULT_LAW = "hunt-crossley"


def nominal_model(experiment: Experiment, law: str | None) -> Model:
    """The model that the experiment names, with every parameter at its order of magnitude."""
    name = law or experiment.law or DEFAULT_LAW
    if name not in LAWS:
        raise ExperimentError(f"unknown contact law {name!r}: expected one of {', '.join(LAWS)}")
    kind = SUSPENSIONS[experiment.suspension.kind]
    geometry: dict[str, Any] = {} if experiment.suspension.length is None else {"length": experiment.suspension.length}
    numbers: dict[str, Any] = {p.field: p.start for p in (*kind.parameters, *LAWS[name].parameters)}
    return Model(
        mass=experiment.mass,
        suspension=kind(**{p.field: numbers[p.field] for p in kind.parameters}, **geometry),
        law=LAWS[name](**{p.field: numbers[p.field] for p in LAWS[name].parameters}),
    )
