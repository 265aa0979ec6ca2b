"""From an experiment to windows and a first guess: everything that happens before the first integration."""

import dataclasses

import numpy as np

from identification import measured_input
from identification.experiment import Experiment, ExperimentError, Record
from identification.kinematics import Kinematics, kinematics
from identification.lanes import grouped, initial_states, lane
from identification.layout import Estimate, Layout
from identification.start import contact_start, harmonic_start, suspension_start
from identification.windows import WindowLength, Windows, cut
from vibrojax.contact import LAWS
from vibrojax.excitation import SampledMotion
from vibrojax.model import MASS, Model
from vibrojax.suspension import SUSPENSIONS

DEFAULT_LAW = "hunt-crossley"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Prepared:
    """What a fit begins with."""

    experiment: Experiment
    model: Model
    layout: Layout
    fixed: dict[str, float]
    """Parameters held at the operator's value."""
    groups: tuple[Windows, ...]
    """Windows by kind of excitation."""
    start: Estimate
    candidates: dict[str, np.ndarray]
    """Shared parameters (internal coordinates) by where they were read; the first is that of `start`."""
    motions: tuple[Kinematics | None, ...]
    """Per record: smoothed motion, None where the motion against the stop was not recorded."""
    carts: tuple[SampledMotion | None, ...]
    """Per record: motion of the cart where it was measured and drives the model."""

    @property
    def record(self) -> np.ndarray:
        """Record index of every window, group after group."""
        return np.concatenate([group.record for group in self.groups])

    def with_groups(self, groups: tuple[Windows, ...]) -> "Prepared":
        """The same with other windows (weights) in the same order."""
        return dataclasses.replace(self, groups=groups)


def prepare(experiment: Experiment, *, law: str | None = None, window: WindowLength | None = None) -> Prepared:
    """Cut the records into windows and guess where the fit should start; raises `ExperimentError` for what cannot be fitted."""
    model = nominal_model(experiment, law)
    parameters = model.parameters + (() if experiment.mass_is_known else (MASS,))
    fixed = _fixed(experiment, [p.name for p in parameters])
    layout = Layout(parameters=parameters)
    records = list(experiment.records)
    bases = [harmonic_start(record) for record in records]
    measured = [measured_input.measured_motion(record) if record.base == "measured" else None for record in records]
    accelerations = [_base_acceleration(r, b, m) for r, b, m in zip(records, bases, measured, strict=True)]
    motions = [kinematics(r, mass=experiment.mass, base_acceleration=a) for r, a in zip(records, accelerations, strict=True)]

    guesses = _guesses(experiment, model, records, motions)
    values, gap_errors = next(iter(guesses.values()))
    window = window or WindowLength()
    cuts = [cut(record, motion, window.samples(record, motion)) for record, motion in zip(records, motions, strict=True)]
    longest = max(length for parts in cuts for _, length in parts)
    lanes = [
        lane(index, record, first, length, longest, measured[index])
        for index, record in enumerate(records)
        for first, length in cuts[index]
    ]
    groups = grouped(lanes)
    states = np.concatenate([initial_states(group, motions) for group in groups])
    nuisances = np.array([(amplitude, phase, error) for (amplitude, phase), error in zip(bases, gap_errors, strict=True)])
    start = Estimate(shared=layout.internal(values), nuisances=nuisances, states=states)
    return Prepared(
        experiment=experiment,
        model=model.replace(values),
        layout=layout,
        fixed=fixed,
        groups=groups,
        start=start,
        candidates={origin: layout.internal(guess) for origin, (guess, _) in guesses.items()},
        motions=tuple(motions),
        carts=tuple(measured),
    )


def impact_windows(prepared: Prepared, count: int) -> tuple[Windows, np.ndarray] | None:
    """A few single impacts of different force, each a short window of its own, and their initial states; None if there are none.

    Only records whose cart is at rest or moves harmonically are used.
    """
    found = []
    for index, (motion, cart) in enumerate(zip(prepared.motions, prepared.carts, strict=True)):
        if motion is None or cart is not None or prepared.experiment.records[index].kind == "forced":
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], motion.touching, [False]]).astype(int)))
        found += [
            (float(motion.inertia[a:b].max()), index, a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a > 0 and b < len(motion.u)
        ]
    if not found:
        return None
    found.sort()
    chosen = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, count).round().astype(int))]
    margin = max(8, int(np.median([b - a for _, _, a, b in chosen])))
    spans = [(index, max(a - margin, 0), b + margin) for _, index, a, b in chosen]
    records = prepared.experiment.records
    longest = max(stop - first for _, first, stop in spans)
    lanes = [lane(i, records[i], first, min(stop, len(records[i].time)) - first, longest, None) for i, first, stop in spans]
    (group,) = grouped(lanes)
    return group, initial_states(group, prepared.motions)


def nominal_model(experiment: Experiment, law: str | None) -> Model:
    """The model that the experiment names, with every parameter at its order of magnitude."""
    name = law or experiment.law or DEFAULT_LAW
    if name not in LAWS:
        raise ExperimentError(f"unknown contact law {name!r}: expected one of {', '.join(LAWS)}")
    kind = SUSPENSIONS[experiment.suspension.kind]
    geometry = {"length": experiment.suspension.length} if experiment.suspension.length is not None else {}
    return Model(
        mass=experiment.mass,
        suspension=kind(**{p.field: p.start for p in kind.parameters}, **geometry),
        law=LAWS[name](**{p.field: p.start for p in LAWS[name].parameters}),
    )


def _fixed(experiment: Experiment, names: list[str]) -> dict[str, float]:
    """Parameters that the operator holds, after a check that all named ones exist."""
    unknown = [name for name in experiment.parameters if name not in names]
    if unknown:
        raise ExperimentError(f"unknown parameter {unknown[0]!r} in [parameters]: this model has {', '.join(names)}")
    return {name: option.start for name, option in experiment.parameters.items() if option.fixed and option.start is not None}


def _base_acceleration(record: Record, base: tuple[float, float], measured: SampledMotion | None) -> np.ndarray:
    """y'' of the first guess, m/s^2."""
    if measured is not None:
        signal = measured.second_derivative
        return np.concatenate([signal.coefficients[3], [signal.coefficients[3][-1]]])
    if record.kind != "cart-excitation":
        return np.zeros_like(record.time)
    omega = 2 * np.pi * record.excitation_frequency
    return -base[0] * omega**2 * np.sin(omega * record.time + base[1])


def _guesses(experiment: Experiment, model: Model, records, motions) -> dict[str, tuple[dict[str, float], np.ndarray]]:
    """First guesses of every shared parameter and of the gap errors, by origin: the operator's value before the data's before the usual."""
    wanted = {name: option.start for name, option in experiment.parameters.items() if option.start is not None}
    suspension, mass = suspension_start(records, motions, mass=experiment.mass if experiment.mass_is_known else None)
    listed = {p.name for p in model.suspension.parameters}
    values = {name: float(value) for name, value in model.values().items()} | {k: v for k, v in suspension.items() if k in listed}
    if not experiment.mass_is_known:
        values[MASS.name] = mass if mass is not None else experiment.mass
    values |= wanted
    model = model.replace(values)
    free = tuple(p.name for p in model.law.parameters if p.name not in wanted)
    found = {origin: contact_start(model, records, motions, free, load_cell=origin == "load cell") for origin in ("load cell", "inertia")}
    guesses = {origin: (values | contact, gap_errors) for origin, (contact, gap_errors) in found.items() if contact}
    return guesses or {"usual values": (values, np.zeros(len(records)))}


def impact_windows(prepared: Prepared, count: int) -> tuple[Windows, np.ndarray] | None:
    """A few single impacts of different force, each a short window of its own, and their initial states; None if there are none.

    Only records whose cart is at rest or moves harmonically are used.
    """
    found = []
    for index, (motion, cart) in enumerate(zip(prepared.motions, prepared.carts, strict=True)):
        if motion is None or cart is not None or prepared.experiment.records[index].kind == "forced":
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], motion.touching, [False]]).astype(int)))
        found += [
            (float(motion.inertia[a:b].max()), index, a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a > 0 and b < len(motion.u)
        ]
    if not found:
        return None
    found.sort()
    chosen = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, count).round().astype(int))]
    margin = max(8, int(np.median([b - a for _, _, a, b in chosen])))
    spans = [(index, max(a - margin, 0), b + margin) for _, index, a, b in chosen]
    records = prepared.experiment.records
    longest = max(stop - first for _, first, stop in spans)
    lanes = [lane(i, records[i], first, min(stop, len(records[i].time)) - first, longest, None) for i, first, stop in spans]
    (group,) = grouped(lanes)
    return group, initial_states(group, prepared.motions)


def nominal_model(experiment: Experiment, law: str | None) -> Model:
    """The model that the experiment names, with every parameter at its order of magnitude."""
    name = law or experiment.law or DEFAULT_LAW
    if name not in LAWS:
        raise ExperimentError(f"unknown contact law {name!r}: expected one of {', '.join(LAWS)}")
    kind = SUSPENSIONS[experiment.suspension.kind]
    geometry = {"length": experiment.suspension.length} if experiment.suspension.length is not None else {}
    return Model(
        mass=experiment.mass,
        suspension=kind(**{p.field: p.start for p in kind.parameters}, **geometry),
        law=LAWS[name](**{p.field: p.start for p in LAWS[name].parameters}),
    )


def _fixed(experiment: Experiment, names: list[str]) -> dict[str, float]:
    """Parameters that the operator holds, after a check that all named ones exist."""
    unknown = [name for name in experiment.parameters if name not in names]
    if unknown:
        raise ExperimentError(f"unknown parameter {unknown[0]!r} in [parameters]: this model has {', '.join(names)}")
    return {name: option.start for name, option in experiment.parameters.items() if option.fixed and option.start is not None}


def _base_acceleration(record: Record, base: tuple[float, float], measured: SampledMotion | None) -> np.ndarray:
    """y'' of the first guess, m/s^2."""
    if measured is not None:
        signal = measured.second_derivative
        return np.concatenate([signal.coefficients[3], [signal.coefficients[3][-1]]])
    if record.kind != "cart-excitation":
        return np.zeros_like(record.time)
    omega = 2 * np.pi * record.excitation_frequency
    return -base[0] * omega**2 * np.sin(omega * record.time + base[1])


def _guess(experiment: Experiment, model: Model, fixed, records, motions) -> tuple[dict[str, float], np.ndarray]:
    """First guess of every shared parameter and of the gap errors: the operator's, else the data's, else the order of magnitude."""
    wanted = {name: option.start for name, option in experiment.parameters.items() if option.start is not None}
    suspension, mass = suspension_start(records, motions, mass=experiment.mass if experiment.mass_is_known else None)
    listed = {p.name for p in model.suspension.parameters}
    values = {name: float(value) for name, value in model.values().items()} | {k: v for k, v in suspension.items() if k in listed}
    if not experiment.mass_is_known:
        values[MASS.name] = mass if mass is not None else experiment.mass
    values |= wanted
    model = model.replace(values)
    free = tuple(p.name for p in model.law.parameters if p.name not in wanted)
    contact, gap_errors = contact_start(model, records, motions, free)
    return values | contact, gap_errors
