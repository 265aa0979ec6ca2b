"""Preparation of a fit: windows, unknowns and first guesses of an experiment, before any integration."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from identification.experiment import Experiment, Record
from identification.windows.clearance import check_clearance
from identification.windows.declared_model import check_smoothing, check_wishes, expected, nominal_model, priors, within_bounds
from identification.windows.integrated_motion import integrated_motions
from identification.windows.kinematics import Kinematics, kinematics
from identification.windows.lanes import Inputs, grouped, initial_states, inputs_of, lane
from identification.windows.layout import Estimate, Layout, layout_of
from identification.windows.release import from_release
from identification.windows.start import first_guesses, harmonic_acceleration, harmonic_start, unseen_bases
from identification.windows.windows import WindowLength, Windows, cut, thinned
from vibrojax.contact import NoContact
from vibrojax.errors import InputError
from vibrojax.excitation import SampledMotion
from vibrojax.model import MASS, Model

MOST_SAMPLES = 250e3
"""Samples that a fit takes, about: time and memory grow in proportion, standard errors fall with the square root only."""
_PADDED_TO = 256
"""Windows are padded to a multiple of this many samples, so that experiments of one kind share a compiled program."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Prepared:
    """Windows, model, layout and start of a fit."""

    experiment: Experiment
    model: Model
    layout: Layout
    fixed: dict[str, float]
    """Parameters fixed at the operator's value."""
    groups: tuple[Windows, ...]
    """Windows by kind of excitation."""
    start: Estimate
    candidates: dict[str, np.ndarray]
    """Start values of the shared parameters (internal coordinates) by origin; the first is that of `start`."""
    motions: tuple[Kinematics | None, ...]
    """Per record: smoothed motion, None where the motion against the stop was not recorded."""
    carts: tuple[SampledMotion | None, ...]
    """Per record: motion of the cart where it was measured and drives the model."""
    smoothing: float | None = None
    """Width of the contact switch of a fit with the smoothed law, m; None for the exact contact."""
    window: WindowLength = WindowLength()
    most_samples: float = np.inf
    """Both as in `prepare`."""

    @property
    def record(self) -> np.ndarray:
        """Record index of every window, group after group."""
        return np.concatenate([group.record for group in self.groups])

    def with_groups(self, groups: tuple[Windows, ...]) -> "Prepared":
        """The same preparation with other windows (weights) in the same order."""
        return dataclasses.replace(self, groups=groups)


def check_precision() -> None:
    """Raise `InputError` unless JAX computes in double precision."""
    if jnp.result_type(float) != jnp.float64:
        raise InputError('JAX computes in single precision: expected float64; call jax.config.update("jax_enable_x64", True) first')


def prepare(
    experiment: Experiment,
    *,
    law: str | None = None,
    window: WindowLength | None = None,
    smoothing: float | None = None,
    most_samples: float = np.inf,
) -> Prepared:
    """Cut the records into windows and derive first guesses.

    Held-back records are excluded here, so that nothing built on windows depends on them. The part of a record before the release of a held
    hammer is excluded as well.

    Args:
        experiment: whole, as loaded.
        law: contact law by name; the experiment's own, else the nominal one, if None.
        window: length of the windows.
        smoothing: width of the contact switch, m; None for the exact contact.
        most_samples: where there are more, windows spread evenly over the records, and a part of many records, are taken. Records that
            are cropped are taken whole.

    Raises:
        ExperimentError: the experiment cannot be fitted.
        InputError: JAX has not been set to double precision.
    """
    check_precision()
    model = nominal_model(experiment.fitting, law)
    check_smoothing(model.law, smoothing)
    check_clearance(experiment, model.law)
    window = window or WindowLength()
    records = [from_release(record) for record in selected(experiment.fitting.records, most_samples, window)]
    experiment = dataclasses.replace(experiment, records=tuple(records))
    parameters = model.parameters + (() if experiment.mass_is_known else (MASS,))
    check_wishes(experiment, parameters)
    fixed = {name: option.start for name, option in experiment.parameters.items() if option.fixed and option.start is not None}
    model = model.replace(expected(experiment))
    zeros = tuple((channel, sensor.zero) for channel, sensor in experiment.sensors.items() if sensor.zero is not None)
    files = tuple(record.file for record in experiment.records)
    layout = layout_of(model, *parameters[len(model.parameters) :], files=files, zeros=zeros, priors=priors(experiment))
    layout = dataclasses.replace(layout, parameters=within_bounds(experiment, layout.parameters))
    bases = [harmonic_start(record) for record in records]
    inputs = [inputs_of(record) for record in records]
    measured = [each.cart for each in inputs]
    accelerations = [_base_acceleration(r, b, m) for r, b, m in zip(records, bases, measured, strict=True)]
    motions = [kinematics(r, mass=experiment.mass, base_acceleration=a) for r, a in zip(records, accelerations, strict=True)]
    motions, sines = unseen_bases(records, motions, mass=experiment.mass, load=experiment.load)
    motions, more = integrated_motions(
        records, motions, accelerations, mass=experiment.mass, stop=not isinstance(model.law, NoContact), load=experiment.load
    )
    bases = [(sines | more).get(index, base) for index, base in enumerate(bases)]

    guesses = first_guesses(experiment, model, motions)
    values, gap_errors = next(iter(guesses.values()))
    cuts = _cuts(records, motions, window, most_samples)
    groups = _groups(records, inputs, cuts)
    states = np.concatenate([initial_states(group, motions) for group in groups])
    nuisances = np.array([(amplitude, phase, error) for (amplitude, phase), error in zip(bases, gap_errors, strict=True)])
    nuisances = np.pad(nuisances, [(0, 0), (0, len(zeros))])
    start = Estimate(shared=layout.clipped(values), nuisances=nuisances, states=states)
    return Prepared(
        experiment=experiment,
        model=model.replace(layout.physical(start.shared)),
        layout=layout,
        fixed=fixed,
        groups=groups,
        start=start,
        candidates={origin: layout.clipped(guess) for origin, (guess, _) in guesses.items()},
        motions=tuple(motions),
        carts=tuple(measured),
        smoothing=smoothing,
        window=window,
        most_samples=most_samples,
    )


def selected(records: tuple[Record, ...], most_samples: float, window: WindowLength) -> tuple[Record, ...]:
    """Records that are used: all, or an even selection of each kind with the same channels.

    The selection is made where two windows of each would be too many samples.
    """
    most = most_samples / (2 * window.longest)
    if len(records) <= most or sum(len(record.time) for record in records) <= most_samples:
        return records
    alike: dict[tuple[Any, ...], list[int]] = {}
    for index, record in enumerate(records):
        alike.setdefault((record.kind, record.preparation.crop is not None, *sorted(record.channels)), []).append(index)
    chosen = set[int]()
    for (_, cropped, *_), group in alike.items():
        count = len(group) if cropped else max(1, round(most * len(group) / len(records)))
        chosen |= {group[place] for place in np.linspace(0, len(group) - 1, count).round().astype(int)}
    return tuple(records[index] for index in sorted(chosen))


def _cuts(
    records: list[Record], motions: list[Kinematics | None], window: WindowLength, most_samples: float
) -> list[list[tuple[int, int]]]:
    """First sample and length of the windows of each record, thinned out to so many samples beside those of cropped records."""
    cuts = [cut(record, motion, window.samples(record, motion)) for record, motion in zip(records, motions, strict=True)]
    lengths, whole = [len(record.time) for record in records], [record.preparation.crop is not None for record in records]
    taken = sum(length for length, cropped in zip(lengths, whole, strict=True) if cropped)
    share = max(most_samples - taken, 0.0) / max(sum(lengths) - taken, 1)
    return [parts if cropped else thinned(parts, share) for parts, cropped in zip(cuts, whole, strict=True)]


def _groups(records: Sequence[Record], inputs: Sequence[Inputs], cuts: list[list[tuple[int, int]]]) -> tuple[Windows, ...]:
    """The windows of all records, padded to one length and stacked by kind of excitation."""
    longest = 1 + max(length for parts in cuts for _, length in parts)  # one more sample for readings between samples
    longest += -longest % _PADDED_TO
    return grouped(
        [
            lane(index, record, first, length, longest, inputs[index])
            for index, record in enumerate(records)
            for first, length in cuts[index]
        ]
    )


def _base_acceleration(record: Record, base: tuple[float, float], measured: SampledMotion | None) -> np.ndarray:
    """Cart acceleration y'' of the first guess, m/s^2."""
    if measured is not None:
        signal = measured.second_derivative
        return np.concatenate([signal.coefficients[3], [signal.coefficients[3][-1]]])
    return harmonic_acceleration(record, *base)


def windows_of(prepared: Prepared, chosen: np.ndarray) -> Prepared:
    """Selected windows in their order, with their own start; unchanged where all are selected."""
    if np.array_equal(chosen, np.arange(len(prepared.record))):
        return prepared
    groups, begin = [], 0
    for group in prepared.groups:
        mine = chosen[(chosen >= begin) & (chosen < begin + len(group.record))] - begin
        begin += len(group.record)
        if len(mine):
            groups.append(jax.tree.map(lambda leaf, mine=mine: leaf[mine], group))
    start = prepared.start
    force = start.force[chosen] if len(start.force) else start.force
    start = dataclasses.replace(start, states=start.states[chosen], force=force)
    return dataclasses.replace(prepared, groups=tuple(groups), start=start)
