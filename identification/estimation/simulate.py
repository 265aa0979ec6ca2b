"""Simulation of a model along the records of an experiment."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np

from identification.experiment import ExperimentError, Record
from identification.guesses.motion import harmonic_acceleration, harmonic_start, inputs_of, kinematics
from vibrojax.channels import CHANNELS, EVERY_CHANNEL, channels
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.errors import NoConvergenceError
from vibrojax.excitation import Harmonic, Unforced, at_rest
from vibrojax.integrate import RESULT_MESSAGES, SUCCESS, Guided, Landing
from vibrojax.integrate.landing import flight_step
from vibrojax.model import Model
from vibrojax.system import System


def simulate_record(model: Model, record: Record, *, as_recorded: bool = False) -> dict[str, np.ndarray]:
    """Simulate one record: `time` and every model channel, SI, each of shape (samples,).

    The initial state and the sine of the cart are those that the record states; otherwise they come from its channels, like the first guess
    of a fit. Sensor faults among the model's effects are left out unless `as_recorded`.

    Raises `ExperimentError` where the record gives neither, `NoConvergenceError` where the integration fails.
    """
    if not as_recorded:
        model = dataclasses.replace(without_faults(model), recorder=())
    amplitude, phase = _base(record)
    system = system_in(model, record, amplitude, phase)
    state = _state(model, record, amplitude, phase)
    guided = inputs_of(record).prescribed
    integrator = _integrator(model, record) if guided is None else Guided(guided)
    trajectory = integrator(system, jnp.asarray(record.time), jnp.asarray(state))
    result = int(trajectory.result)
    if result != SUCCESS:
        raise NoConvergenceError(f"record {record.file!r} cannot be simulated: {RESULT_MESSAGES[result]}")
    readings = channels(system, trajectory)
    names = CHANNELS if guided is None else EVERY_CHANNEL
    return {"time": record.time} | {name: np.asarray(readings[name]) for name in names}


def without_faults(model: Model) -> Model:
    """The model without those of its effects that are faults of a sensor."""
    return dataclasses.replace(model, effects=tuple(effect for effect in model.effects if not effect.is_fault))


def _integrator(model: Model, record: Record) -> Landing:
    """Integrator with steps for the fastest vibration, and capacity for an impact in every half cycle of it."""
    fastest = max(record.excitation_frequency or 0.0, float(model.values().get("f_n", 0.0)))
    contact_steps, a_period = 100.0, 200.0
    duration, sampling = record.time[-1] - record.time[0], float(np.median(np.diff(record.time)))
    flight = float(flight_step(model.effects, fastest, a_period=a_period, an_own_period=24.0))
    flight = min(flight, duration / a_period)
    if record.base == "measured" or record.kind == "forced":
        flight = min(flight, sampling)
    steps = 2 * duration * (1 / flight + 2 * fastest * contact_steps) + 20 * contact_steps
    return Landing(contact_steps=contact_steps, flight_step=flight, most_steps=math.ceil(steps))


def _base(record: Record) -> tuple[float, float]:
    """Amplitude and phase of the cart's sine, as stated or from the channels."""
    if record.kind != "cart-excitation" or record.base == "measured":
        return 0.0, 0.0
    amplitude, phase = record.base_amplitude, record.base_phase
    if "cart_displacement" in record.channels or "cart_acceleration" in record.channels:
        seen = harmonic_start(record)
        return seen[0] if amplitude is None else amplitude, seen[1] if phase is None else phase
    if amplitude is not None:
        return amplitude, phase or 0.0
    raise ExperimentError(
        f"record {record.file!r} states no base_amplitude and holds no cart channel: add base_amplitude (m) and base_phase (rad)"
    )


def system_in(model: Model, record: Record, amplitude: float = 0.0, phase: float = 0.0) -> System:
    """The rig in one record; `amplitude`, m, and `phase`, rad, are those of the cart's sine."""
    given, base = inputs_of(record), at_rest()
    if given.cart is not None:
        base = given.cart
    elif record.kind == "cart-excitation":
        base = Harmonic(base_amplitude=amplitude, base_phase=phase, frequency_hz=record.excitation_frequency or 0.0)
    applied = Unforced() if given.applied is None else given.applied
    here = model.in_record(lambda file: 1.0 if file == record.file else 0.0)
    return here.system(gap=record.gap, base=base, applied=applied)


def _state(model: Model, record: Record, amplitude: float, phase: float) -> np.ndarray:
    """Initial displacement and velocity of the hammer relative to the cart, as stated or from the channels."""
    stated = (record.initial_displacement, record.initial_velocity)
    if isinstance(model.law, AbstractInstantaneousLaw) and stated[0] is not None and stated[0] > record.gap:
        raise ExperimentError(
            f"record {record.file!r} begins {stated[0] - record.gap:.3g} m behind a rigid stop: expected initial_displacement <= gap"
        )
    if None not in stated:
        return np.array(stated)
    acceleration = harmonic_acceleration(record, amplitude, phase)
    motion = kinematics(record, mass=float(model.mass), base_acceleration=acceleration) if record.channels else None
    if motion is None:
        raise ExperimentError(
            f"record {record.file!r} states no initial_displacement and initial_velocity and its channels do not show them:"
            " add both (m and m/s, hammer minus cart)"
        )
    return np.array([motion.u[0] if stated[0] is None else stated[0], motion.v[0] if stated[1] is None else stated[1]])
