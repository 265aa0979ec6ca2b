"""From an experiment to windows and a first guess: everything that happens before the first integration."""

import dataclasses

import jax
import numpy as np

from identification import measured_input
from identification.experiment import Experiment, ExperimentError, Record
from identification.kinematics import Kinematics, kinematics
from identification.layout import Estimate, Layout
from identification.start import contact_start, harmonic_start, suspension_start
from identification.windows import FITTED_CHANNELS, WindowLength, Windows, cut
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
    touching: tuple[np.ndarray | None, ...]
    """Per record: samples in contact, shape (samples,); None where the motion against the stop was not recorded."""

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

    values, gap_errors = _guess(experiment, model, fixed, records, motions)
    window = window or WindowLength()
    cuts = [cut(record, motion, window.samples(record, motion)) for record, motion in zip(records, motions, strict=True)]
    longest = max(length for parts in cuts for _, length in parts)
    lanes = [
        _lane(index, record, first, length, longest, measured[index])
        for index, record in enumerate(records)
        for first, length in cuts[index]
    ]
    groups = _grouped(lanes)
    states = np.concatenate([_states(group, motions) for group in groups])
    nuisances = np.array([(amplitude, phase, error) for (amplitude, phase), error in zip(bases, gap_errors, strict=True)])
    start = Estimate(shared=layout.internal(values), nuisances=nuisances, states=states)
    touching = tuple(None if motion is None else motion.touching for motion in motions)
    return Prepared(
        experiment=experiment, model=model.replace(values), layout=layout, fixed=fixed, groups=groups, start=start, touching=touching
    )


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


def _lane(index: int, record: Record, first: int, length: int, samples: int, motion: SampledMotion | None) -> Windows:
    """One window, padded to `samples`."""
    present = np.arange(first, first + length)
    dt = float(np.median(np.diff(record.time)))
    ts = record.time[present[-1]] + dt * np.arange(1 - length, samples - length + 1)
    ts[:length] = record.time[present]
    measured, weight = np.zeros((samples, len(FITTED_CHANNELS))), np.zeros((samples, len(FITTED_CHANNELS)))
    for column, name in enumerate(FITTED_CHANNELS):
        if name not in record.channels or (name.startswith("cart") and motion is not None):
            continue
        values = record.channels[name][present]
        usable = np.isfinite(values)
        measured[:length, column] = np.where(usable, values, 0.0)
        weight[:length, column] = usable / record.noise[name]
    driven = record.kind == "cart-excitation" and motion is None
    return Windows(
        record=np.asarray(index),
        first=np.asarray(first),
        lengths=np.asarray(length),
        ts=ts,
        measured=measured,
        weight=weight,
        gap=np.asarray(record.gap),
        frequency_hz=np.asarray(record.excitation_frequency if driven else 0.0),
        motion=None
        if motion is None
        else SampledMotion(
            position=measured_input.part(motion.position, first, samples),
            second_derivative=measured_input.part(motion.second_derivative, first, samples),
        ),
        applied=None
        if record.kind != "forced"
        else type(force := measured_input.measured_force(record))(signal=measured_input.part(force.signal, first, samples)),
        channels=FITTED_CHANNELS,
    )


def _grouped(lanes: list[Windows]) -> tuple[Windows, ...]:
    """Windows of one kind of excitation stacked, channels that none of them holds left out."""
    kinds: dict[tuple[bool, bool], list[Windows]] = {}
    for lane in lanes:
        kinds.setdefault((lane.motion is None, lane.applied is None), []).append(lane)
    stacked = [jax.tree.map(lambda *leaves: np.stack(leaves), *group) for group in kinds.values()]
    return tuple(_without_empty(group) for group in stacked)


def _without_empty(group: Windows) -> Windows:
    """The group with only those channels that count somewhere."""
    used = np.flatnonzero(group.weight.any(axis=(0, 1)))
    return dataclasses.replace(
        group,
        measured=group.measured[:, :, used],
        weight=group.weight[:, :, used],
        channels=tuple(group.channels[column] for column in used),
    )


def _states(group: Windows, motions: list[Kinematics | None]) -> np.ndarray:
    """Initial state of every window, read off the smoothed record; zero where that is not known."""
    states = np.zeros((len(group.record), 2))
    for lane, (record, first) in enumerate(zip(group.record, group.first, strict=True)):
        motion = motions[record]
        if motion is not None:
            states[lane] = motion.u[first], motion.v[first]
    return states
