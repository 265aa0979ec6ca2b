"""Where a fit begins: the measured trajectory, and parameters read off the records. Nothing is integrated."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax
import numpy as np
from jaxtyping import Float
from scipy.signal import find_peaks

from identification.experiment import Experiment, ParameterOption, Record
from identification.guesses.declared_model import check_precision, check_wishes, nominal_model, priors, varying, within_bounds
from identification.guesses.fitted_part import from_release
from identification.guesses.motion import (
    Kinematics,
    driven_by,
    driving_channels,
    harmonic_acceleration,
    harmonic_start,
    input_noise,
    inputs_of,
    kinematics,
    relative_displacement,
)
from identification.guesses.parameters import GAP_PRIOR_STD_M, first_guesses
from identification.guesses.unseen_motion import integrated_motions, unseen_bases
from identification.trajectory.chain_equations import Border, Scales
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import (
    APPROACH_SPEED,
    Chains,
    Unknowns,
    chains_of,
    samples_of_a_segment,
    unknowns_of,
)
from identification.trajectory.thinning import thinned
from vibrojax.contact import AbstractInstantaneousLaw, NoContact
from vibrojax.integrate import Landing
from vibrojax.integrate.landing import flight_step
from vibrojax.model import MASS, Model
from vibrojax.parameters import Parameter

_PARABOLA = 2
"""Degree of the polynomial by which a speed beside an impact is read."""
_CLEAR = 5.0
"""Distance from a place at which a reading is clearly off it, over the noise."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Problem:
    """An experiment as chains, with its model, unknowns and a first estimate.

    Attributes:
        experiment: that is fitted, from the release of a held hammer on.
        model: nominal, or with effects; its numbers are those of the estimate.
        parameters: shared, in the order of the unknowns.
        unknowns, chains, border, scales: of the equations.
        integrator: through a segment.
        rest: by record, times between which a body flies too low from a rigid stop to be seen, and from which it rests, s.
        motions: smoothed relative motion of each record, None where no sensor shows it.
        start: first estimate.
    """

    experiment: Experiment
    model: Model
    parameters: tuple[Parameter, ...]
    unknowns: Unknowns
    chains: Chains
    border: Border
    scales: Scales
    integrator: Landing
    rest: tuple[tuple[float, float], ...]
    motions: tuple[Kinematics | None, ...]
    start: Estimate

    def mass(self, at: Estimate) -> float:
        """Of the hammer, kg: as stated, or as estimated."""
        return self.values(at).get(MASS.name, self.experiment.mass)

    def values(self, at: Estimate) -> dict[str, float]:
        """Shared parameters by name, SI."""
        return {name: float(np.exp(x)) if log else float(x) for (name, log), x in zip(self.unknowns.shared, at.shared, strict=True)}

    def coordinates(self, values: Mapping[str, float]) -> Float[np.ndarray, " shared"]:
        """The shared unknowns, in their coordinate, of parameters by name, SI."""
        return np.array([np.log(values[name]) if log else values[name] for name, log in self.unknowns.shared])

    def model_at(self, at: Estimate) -> Model:
        """The model with the numbers of an estimate."""
        return self.model.replace(self.values(at))


def problem_of(experiment: Experiment, *, law: str | None = None, earlier: Mapping[str, float] | None = None) -> Problem:
    """Chains of an experiment's records that are not held back, with first guesses.

    Args:
        experiment: as loaded.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        earlier: values of an earlier fit by name, SI, which take the place of first guesses where the experiment gives no start.

    Raises:
        ExperimentError: the experiment cannot be fitted.
        InputError: JAX computes in single precision.
    """
    check_precision()
    experiment, earlier = experiment.fitting, dict(earlier or {})
    records = [from_release(record) for record in experiment.records]
    model = nominal_model(experiment, law)
    if isinstance(model.law, NoContact):
        records = thinned(records)
    records = [_with_input_noise(record, experiment.mass) for record in records]
    experiment = dataclasses.replace(experiment, records=tuple(records))
    parameters = model.parameters + (() if experiment.mass_is_known else (MASS,))
    check_wishes(experiment, parameters)
    parameters = within_bounds(experiment, parameters)
    model = model.replace({name: mean for name, mean, _ in priors(experiment) if name != MASS.name})  # where records show no first guess
    zeros = {channel: sensor.zero for channel, sensor in experiment.sensors.items() if sensor.zero is not None}
    unknowns = unknowns_of(model, parameters, zeros=tuple(zeros), varying=varying(experiment))

    values, own, motions = _first(experiment, model, parameters, earlier)
    f_n = values.get("f_n", 0.0)
    filters = [state.scale for one in model.recorder for state in one.own_states]
    scales = _scales(experiment, motions, f_n, filters, unknowns)
    fastest = _fastest(experiment, f_n, scales)
    rest = [_rest(record, motion, values.get("e")) for record, motion in zip(records, motions, strict=True)]
    chains = chains_of(records, samples_of_a_segment(records, fastest, mass=experiment.mass, resolution=scales.resolution), rest=rest)
    flight = step_in_flight(records, model, fastest)
    own = np.pad(own, ((0, 0), (0, len(unknowns.own) - own.shape[1])))
    shared = np.array([np.log(values[p.name]) if p.logarithmic else values[p.name] for p in parameters])
    states = _first_states(experiment, model, chains, unknowns, motions, fastest)
    start = Estimate(states=states, force=np.zeros(chains.knot_count), shared=shared, own=own)
    return Problem(
        experiment=experiment,
        model=model.replace(values),
        parameters=parameters,
        unknowns=unknowns,
        chains=chains,
        border=_border(experiment, parameters, unknowns, zeros, start, stop=not isinstance(model.law, NoContact)),
        scales=scales,
        integrator=Landing(contact_steps=jax.device_put(np.asarray(60.0)), flight_step=jax.device_put(np.asarray(flight))),
        rest=tuple(rest),
        motions=tuple(motions),
        start=start,
    )


def begun_from(problem: Problem, records: tuple[Record, ...]) -> Problem:
    """The problem with another beginning: the motion and the parameters that other records show; all else stays that of its own records.

    Args:
        problem: whose effects leave the stop as it is; states of their own begin at rest.
        records: as many as the problem's, in the same order and on the same clocks.
    """
    experiment, nominal = dataclasses.replace(problem.experiment, records=records), dataclasses.replace(problem.model, effects=())
    names = {p.name for p in nominal.parameters} | {MASS.name}
    values, own, motions = _first(experiment, nominal, tuple(p for p in problem.parameters if p.name in names), {})
    fastest = _fastest(experiment, values.get("f_n", 0.0), problem.scales)
    start = dataclasses.replace(
        problem.start,
        states=_first_states(experiment, nominal, problem.chains, problem.unknowns, motions, fastest),
        shared=problem.coordinates(problem.values(problem.start) | values),
        own=np.concatenate([own, problem.start.own[:, own.shape[1] :]], axis=1),
    )
    return dataclasses.replace(problem, start=start, motions=tuple(motions))


def _first(
    experiment: Experiment, model: Model, parameters: tuple[Parameter, ...], earlier: dict[str, float]
) -> tuple[dict[str, float], np.ndarray, list[Kinematics | None]]:
    """Shared parameters by name; the base's two components and the error of the gap, m, (records, 3); and the smoothed motions."""
    records = list(experiment.records)
    bases, motions = _motions(experiment, model)
    given = {name: option.start for name, option in experiment.parameters.items() if option.start is not None}
    given = {p.name: float(np.clip((earlier | given)[p.name], p.lower, p.upper)) for p in parameters if p.name in earlier | given}
    exponents = [p for p in model.law.parameters if not p.logarithmic and p.name not in experiment.parameters]
    usual = {p.name: p.start for p in exponents}  # loops of force over indentation that drift mislead these

    def guessed(known: Mapping[str, float]) -> tuple[dict[str, float], np.ndarray]:
        guided = dataclasses.replace(experiment, parameters={name: ParameterOption(start=at) for name, at in known.items()})
        return first_guesses(guided, model, motions)

    values, gap_errors = guessed(usual | given)
    if earlier:  # gaps are read off the same loops as a contact law, even where all of the law is known
        gap_errors = guessed(usual)[1]
    if isinstance(model.law, AbstractInstantaneousLaw):
        gap_errors = np.array([_furthest(record, motion) for record, motion in zip(records, motions, strict=True)])
        values |= _rebound(records, motions)
    values |= given
    values = {p.name: float(np.clip(values[p.name], max(p.lower, 1e-300), p.upper)) for p in parameters}
    parts = [(size * np.cos(phase), size * np.sin(phase), error) for (size, phase), error in zip(bases, gap_errors, strict=True)]
    return values, np.array(parts), motions


def _first_states(
    experiment: Experiment, model: Model, chains: Chains, unknowns: Unknowns, motions: Sequence[Kinematics | None], fastest: float
) -> Float[np.ndarray, "knots states"]:
    """Relative motion at the knots, smoothed or as it is prescribed; the effects' own states at rest."""
    states = np.zeros((chains.knot_count, len(unknowns.states)))
    for index, (knots, motion, record) in enumerate(zip(chains.knots, motions, experiment.records, strict=True)):
        guided = inputs_of(record).prescribed
        if guided is not None:  # as the segments have it: what it differs by at the knots would count as an error of the motion
            times = record.time[0] + np.concatenate([[0.0], np.cumsum(chains.duration[chains.of_record(index)])])
            states[knots, 0], states[knots, 1] = guided.displacement(times), guided.velocity(times)
        elif motion is not None:
            rows = np.minimum(np.arange(knots.stop - knots.start) * chains.samples, len(motion.u) - 1)
            states[knots, 0], states[knots, 1] = motion.u[rows], motion.v[rows]
            if unknowns.states[-1] == APPROACH_SPEED:
                states[knots, -1] = np.abs(motion.v).max()  # corrected at the first touch
        if isinstance(model.law, AbstractInstantaneousLaw):
            sixth = 1.0 / 6.0 / fastest  # of a period, in which a parabola follows the motion
            states[knots.start, :2] = _beginning(record, sixth, states[knots.start, :2])
    return states


def _fastest(experiment: Experiment, f_n: float, scales: Scales) -> float:
    """Frequency of the fastest vibration of spring and drives, Hz; without any, that of a vibration of the motion's size and speed."""
    excited = [record.excitation_frequency or 0.0 for record in experiment.records]
    return max(f_n, *excited) or scales.velocity / (2.0 * np.pi * scales.displacement)


def _with_input_noise(record: Record, mass: float) -> Record:
    """The record with noise of a recorded force, m/s^2 on the hammer, in its acceleration, which the model takes from that force."""
    force, _ = input_noise(record)
    if not force or "hammer_acceleration" not in record.noise:
        return record
    noise = float(np.hypot(record.noise["hammer_acceleration"], record.noise["applied_force"] / mass))
    return dataclasses.replace(record, noise=record.noise | {"hammer_acceleration": noise})


def step_in_flight(records: Sequence[Record], model: Model, fastest_hz: float) -> float:
    """Longest step, s: a part of the period of the fastest vibration, and no longer than the sampling interval of a recorded input.

    Between longer steps the noise of an input would not average out.
    """
    recorded = [record for record in records if driven_by(record)]
    step = float(flight_step(model.effects, max(fastest_hz, 1e-6), a_period=96.0))  # steps, at least
    return min([step, *(float(np.median(np.diff(record.time))) for record in recorded)])


def weighable(experiment: Experiment) -> bool:
    """Whether the records can show a mass: some force is known, or the mass itself; a motion alone is the same for every mass."""
    felt = ("impact_force", "applied_force", "reaction_force")
    recorded = any(name in record.channels for record in experiment.records for name in felt)
    known = experiment.mass_is_known or getattr(experiment.parameters.get(MASS.name), "prior", None) is not None
    return recorded or known or experiment.load.constant_force != 0.0


def _motions(experiment: Experiment, model: Model) -> tuple[list[tuple[float, float]], list[Kinematics | None]]:
    """Amplitude and phase of every record's cart, and its smoothed motion."""
    records = list(experiment.records)
    bases = [harmonic_start(record) for record in records]
    accelerations = [_base_acceleration(record, base) for record, base in zip(records, bases, strict=True)]
    found = [kinematics(r, mass=experiment.mass, base_acceleration=a) for r, a in zip(records, accelerations, strict=True)]
    found, sines = unseen_bases(records, found, mass=experiment.mass, load=experiment.load)
    stop = not isinstance(model.law, NoContact)
    found, more = integrated_motions(records, found, accelerations, mass=experiment.mass, stop=stop, load=experiment.load)
    return [(sines | more).get(index, base) for index, base in enumerate(bases)], found


def _furthest(record: Record, motion: Kinematics | None) -> float:
    """Setting error of the gap of a rigid stop, m: the hammer gets as far as the stop and no further; 0 where it does not get there.

    From the readings themselves, since smoothing rounds off the impacts.
    """
    u = relative_displacement(record)
    if motion is None or u is None or not (motion.touching.any() or _rebounds(record)):
        return 0.0
    return float(u.max()) - record.gap


def _rest(record: Record, motion: Kinematics | None, restitution: float | None) -> tuple[float, float]:
    """Times between which the flights from a rigid stop are too low to be seen, and from which the body rests on it; infinite where never.

    Behind the last sample that is clearly off the stop, flights last less than T = (8 h / a)^(1/2), with the height h that is clear and the
    acceleration a towards the stop; and all of them together T (1 + e + e^2 + ...).
    """
    if restitution is None or motion is None:
        return np.inf, np.inf
    clear, place = _CLEAR * _noise(record), float(np.median(motion.u[-5:]))  # where the body has come to
    off = np.flatnonzero(np.abs(motion.u - place) > clear)
    flying = motion.a[motion.u < place - 0.3 * np.ptp(motion.u)]
    if not len(off) or motion.u.max() - place > clear or not len(flying) or np.median(flying) <= 0:
        return np.inf, np.inf
    last = float(record.time[off[-1]])
    return last, last + float(np.sqrt(8.0 * clear / np.median(flying))) / (1.0 - min(restitution, 0.99))


def _rebounds(record: Record) -> list[tuple[float, float]]:
    """Speeds before and after each impact on a rigid stop, m/s: slopes there of parabolas through half of the flights on both sides."""
    u, time = relative_displacement(record), record.time
    if u is None:
        return []
    found, clear = [], 2.0 * _CLEAR * _noise(record)
    peaks, _ = find_peaks(u, height=u.max() - 0.2 * np.ptp(u), prominence=clear)
    edges = np.concatenate([[0], (peaks[:-1] + peaks[1:]) // 2, [len(u)]])
    for peak, begin, end in zip(peaks, edges[:-1], edges[1:], strict=True):
        sides = slice(begin, peak), slice(peak + 1, end)
        if min(one.stop - one.start for one in sides) <= _PARABOLA:
            continue
        before, after = (np.polyfit(time[one] - time[peak], u[one], _PARABOLA)[-2] for one in sides)
        if before > 0.0 > after:
            found.append((float(before), float(-after)))
    return found


def _noise(record: Record) -> float:
    """Of the sensor of the relative motion, m; 0 where there is none."""
    return next((record.noise[name] for name in ("relative_displacement", "hammer_displacement") if name in record.noise), 0.0)


def _beginning(record: Record, duration: float, otherwise: np.ndarray) -> np.ndarray:
    """u, m, and u', m/s, at the first sample: of a parabola through so many seconds, or up to the first impact where that is sooner."""
    u, time = relative_displacement(record), record.time - record.time[0]
    if u is None:
        return otherwise
    peaks, _ = find_peaks(u, height=u.max() - 0.2 * np.ptp(u), prominence=2.0 * _CLEAR * _noise(record))
    seen = (time <= duration) & (np.arange(len(u)) < (peaks[0] if len(peaks) else len(u)))
    return np.polyfit(time[seen], u[seen], _PARABOLA)[[2, 1]] if seen.sum() > _PARABOLA + 1 else otherwise


def _rebound(records: list[Record], motions: list[Kinematics | None]) -> dict[str, float]:
    """Restitution: slope of the speeds after over those before the impacts of all records; empty where none is seen."""
    found = [one for record, motion in zip(records, motions, strict=True) if motion is not None for one in _rebounds(record)]
    if not found:
        return {}
    before, after = np.array(found).T
    return {"e": float(np.clip(before @ after / (before @ before), 0.02, 1.0))}


def _base_acceleration(record: Record, base: tuple[float, float]) -> np.ndarray:
    """y'' of the first guess, m/s^2."""
    cart = inputs_of(record).cart
    if cart is None:
        return harmonic_acceleration(record, *base)
    values = np.asarray(cart.second_derivative.coefficients[3])
    return np.concatenate([values, values[-1:]])


def _scales(experiment: Experiment, motions: list[Kinematics | None], f_n: float, filters: list[float], unknowns: Unknowns) -> Scales:
    """Natural sizes of the motion, and of the recorder's `filters`."""
    seen = [one for one in motions if one is not None]
    u = np.concatenate([one.u - one.u.mean() for one in seen]) if seen else np.ones(1)
    v = np.concatenate([one.v for one in seen]) if seen else np.ones(1)
    displacement, velocity = float(np.std(u)), float(np.std(v))
    inertia = np.concatenate([(one.a - np.median(one.a))[~one.touching] for one in seen]) if seen else np.ones(1)
    force = experiment.mass * ((2.0 * np.pi * f_n) ** 2 * displacement if f_n > 0 else float(np.std(inertia)))
    sensors = ("hammer_displacement", "relative_displacement")
    noise = [record.noise[name] for record in experiment.records for name in sensors if name in record.noise]
    own = np.array(filters + [velocity for name in unknowns.states[2:] if name == APPROACH_SPEED])
    return Scales(
        displacement=displacement,
        velocity=velocity,
        force=force,
        resolution=min(noise, default=1e-3 * displacement),
        own=own,
        own_initial=own,
    )


def ranges(parameters: Sequence[Parameter]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Natural size of steps, and least and largest value, of parameters in the coordinate of the fit."""
    return (
        np.array([1.0 if p.logarithmic else p.scale for p in parameters]),
        np.array([np.log(max(p.lower, 1e-300)) if p.logarithmic else p.lower for p in parameters]),
        np.array([np.log(p.upper) if p.logarithmic else p.upper for p in parameters]),
    )


def _border(experiment, parameters, unknowns: Unknowns, zeros, start: Estimate, *, stop: bool) -> Border:
    """Free unknowns, their scales and priors; where the stop is not reached, the gap stays as set by its prior."""
    options = experiment.parameters
    fixed = {name for name, option in options.items() if option.fixed and option.start is not None}
    fixed |= set() if weighable(experiment) else {MASS.name}
    records = experiment.records
    driven = np.array([record.kind == "cart-excitation" and record.base == "sine" for record in records])
    own = np.ones((len(records), len(unknowns.own)), bool)
    own[:, 0], own[:, 1], own[:, 2] = driven, driven, stop
    own_scale, own_std = np.ones(len(unknowns.own)), np.full(len(unknowns.own), np.inf)
    amplitude = max(float(np.abs(start.own[:, :2]).max()), 1e-6)
    own_scale[:3], own_std[2] = (amplitude, amplitude, 1e-4), GAP_PRIOR_STD_M
    for place, name in enumerate(unknowns.own):
        if name.startswith("zero."):
            channel = name[5:]
            own[:, place] = [channel in record.channels and channel not in driving_channels(record) for record in records]
            own_scale[place] = own_std[place] = zeros[channel]
    means = {name: (mean, std) for name, mean, std in priors(experiment)}
    shared_mean, precision = start.shared.copy(), np.zeros(len(parameters))
    for place, p in enumerate(parameters):
        if p.name in means:
            mean, std = means[p.name]
            shared_mean[place] = np.log(mean) if p.logarithmic else mean
            precision[place] = (mean / std) ** 2 if p.logarithmic else std**-2
    scale, lower, upper = ranges(parameters)
    return Border(
        shared=np.array([p.name not in fixed for p in parameters], bool),
        own=own,
        shared_scale=scale,
        own_scale=own_scale,
        shared_mean=shared_mean,
        shared_precision=precision,
        own_mean=np.zeros_like(start.own),
        own_precision=np.broadcast_to(np.where(np.isfinite(own_std), own_std**-2.0, 0.0), start.own.shape).copy(),
        lower=lower,
        upper=upper,
        strengths=np.zeros(len(parameters), bool),
        own_strengths=np.zeros(len(unknowns.own), bool),
    )
