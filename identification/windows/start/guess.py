"""First guesses of all parameters, by origin."""

import numpy as np

from identification.experiment import Experiment
from identification.windows.kinematics import Kinematics
from identification.windows.start.contact import contact_start
from identification.windows.start.prescribed import prescribed_start
from identification.windows.start.suspension import suspension_start
from vibrojax.model import MASS, Model


def first_guesses(experiment: Experiment, model: Model, motions: list[Kinematics | None]) -> dict[str, tuple[dict[str, float], np.ndarray]]:
    """Every shared parameter by name, and the gap errors of the records, m, by origin of the guess, the most reliable first.

    A parameter takes the operator's value if given, else that of the data, else its start value.
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
    found = {origin: contact_start(model, records, motions, free, load_cell=origin == "load cell") for origin in ("load cell", "inertia")}
    guesses = {origin: (values | loops.values, loops.errors) for origin, loops in found.items() if loops is not None}
    return guesses or {"usual values": (values, np.zeros(len(records)))}
