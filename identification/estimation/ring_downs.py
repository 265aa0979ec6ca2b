"""Ring-downs of the records, and of models that swing from the same states, through one estimator, so that its errors cancel."""

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import root_scalar

from identification.estimation.simulate import system_in, without_faults
from identification.experiment import Experiment, Record
from identification.experiment.channels import AT_REST
from identification.experiment.samples import runs_of
from identification.result.result import RecordFit, measured_displacement
from identification.result.ring_down import RingDown, RingDowns, one_flight, ring_down, together
from vibrojax.compiling import soon_compiled
from vibrojax.integrate import SUCCESS, Landing, Trajectory
from vibrojax.integrate.landing import flight_step
from vibrojax.model import Model
from vibrojax.system import System


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Flight:
    """Samples of a record between contacts: displacement u as measured, its noise, and the level about which it swings, m.

    `returns`: a contact ends it; otherwise the hammer may have come to rest in it.
    """

    record: Record
    fit: RecordFit
    part: slice
    u: np.ndarray
    noise: float
    level: float
    returns: bool


def ring_downs(experiment: Experiment, records: tuple[RecordFit, ...], models: Mapping[str, Model]) -> RingDowns:
    """Damping and frequency by amplitude of the free vibrations in the records, and of models that start from the same states.

    Predictions of the records, by the last of the models, give contacts and initial states.
    """
    left_out: dict[str, str] = {}
    flights: list[_Flight] = []
    best = list(models.values())[-1]
    frequency = float(best.values().get("f_n", 0.0))
    for fit in records:
        u = measured_displacement(fit)
        if experiment.suspension.kind == "free":
            left_out[fit.file] = "without a spring nothing vibrates"
        elif fit.kind not in AT_REST:
            left_out[fit.file] = "driven throughout, so that nothing decays"
        elif u is None:
            left_out[fit.file] = "its displacement was not recorded"
        else:
            able = [one for one in _flights(experiment, fit, u, best) if _read(one, one.u, one.level, frequency)[0] is not None]
            flights += able
            if not able:
                left_out[fit.file] = "no swing out and back, between impacts, that its samples resolve"
    longest = max((len(one.u) for one in flights), default=0)
    padded = longest + -longest % 1024  # samples, so that records share a compiled program
    simulated = {
        name: _by_record([(one, _simulated(model, one, padded), rest_place(model, one.record)) for one in flights], frequency)
        for name, model in models.items()
    }
    measured = _by_record([(one, one.u, one.level) for one in flights], frequency)
    return RingDowns(measured=measured, models=simulated, left_out=left_out)


def _by_record(motions: Iterable[tuple[_Flight, np.ndarray, float]], frequency: float) -> tuple[RingDown, ...]:
    """Ring-downs of motions about their levels along flights, record by record; single swings of a record as one."""
    found = []
    for _, group in groupby(motions, key=lambda motion: motion[0].fit.file):
        swings = []
        for motion in group:
            points, single = _read(*motion, frequency)
            if points is not None:
                (swings if single else found).append(points)
        found += [together(swings)] if swings else []
    return tuple(found)


def _read(flight: _Flight, u: np.ndarray, level: float, frequency: float) -> tuple[RingDown | None, bool]:
    """Damping and frequency by amplitude of a motion at the flight's times, and whether it is a single swing out and back."""
    file, time = flight.fit.file, flight.fit.time[flight.part][: len(u)]
    long = ring_down(file, time, u, noise=flight.noise)
    if long is not None or not flight.returns:
        return long, False
    return one_flight(file, time, u, noise=flight.noise, level=level, frequency=frequency), True


def _flights(experiment: Experiment, fit: RecordFit, u: np.ndarray, model: Model) -> Iterator[_Flight]:
    """Flights of a record in which the motion is predicted; the model says where the hammer rests."""
    record = next(one for one in experiment.records if one.file == fit.file)
    names = ("relative_displacement",) if "relative_displacement" in fit.measured else ("hammer_displacement", "cart_displacement")
    noise = math.hypot(*(fit.noise.get(name, 0.0) for name in names))
    read = measured_displacement(dataclasses.replace(fit, measured={name: fit.predicted[name] for name in names if name in fit.measured}))
    known = np.isfinite(fit.relative_displacement) & np.isfinite(fit.relative_velocity)
    level = float(np.median((read - fit.relative_displacement)[known])) if read is not None and known.any() else 0.0
    level += rest_place(model, record)
    near = np.convolve(fit.in_contact, np.ones(5), mode="same") > 0.5  # two samples beside a contact belong to it
    for first, end in zip(*(edges.tolist() for edges in runs_of(known & ~near)), strict=True):
        part, returns = slice(first, end), end < len(near) and bool(near[end])
        yield _Flight(record=record, fit=fit, part=part, u=u[part], noise=noise, level=level, returns=returns)


def rest_place(model: Model, record: Record) -> float:
    """Displacement at which the suspension bears the constant forces on the hammer, clear of the stop, m; 0 where nothing bears them."""
    system = jax.tree.map(np.asarray, system_in(model, record))

    def acceleration(u: float) -> float:
        return float(_at_rest(system, np.asarray(u)))

    found = root_scalar(acceleration, x0=0.0, x1=1e-4, method="secant") if acceleration(0.0) != 0.0 else None  # m
    return float(found.root) if found is not None and found.converged else 0.0


@soon_compiled
def _at_rest(system: System, u):
    """u'' at a place where the hammer stands still, clear of the stop."""
    still = jnp.zeros(())
    return system.forces(still, u, still, jnp.zeros(system.own_size), jnp.asarray(False), still).acceleration


def _simulated(model: Model, one: _Flight, padded: int) -> np.ndarray:
    """Displacement of the model from the state at the beginning of a flight, up to its first contact; empty where it diverges."""
    time, first = one.fit.time[one.part], one.part.start
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    ts = np.concatenate([time, time[-1] + interval * np.arange(1, padded - len(time) + 1)])
    state = np.array([one.fit.relative_displacement[first], one.fit.relative_velocity[first]])
    here = without_faults(model)
    system = jax.tree.map(np.asarray, system_in(here, dataclasses.replace(one.record, gap=one.fit.gap)))
    run = _up_to(_integrator(here, float(ts[-1] - ts[0])), system, ts, state, np.asarray(len(time)))
    if int(run.result[0]) != SUCCESS:
        return np.zeros(0)
    touching = np.flatnonzero(np.asarray(run.in_contact)[0, : len(time)])
    return np.asarray(run.u)[0, : int(touching[0]) if len(touching) else len(time)]


def _integrator(model: Model, duration: float) -> Landing:
    """Steps for the fastest vibration of the suspension and of the effects."""
    f_n, contact_steps = float(model.values().get("f_n", 0.0)), 60.0
    flight = float(flight_step(model.effects, max(f_n, 1.0 / duration), a_period=60.0, an_own_period=24.0))
    steps = 2.0 * duration * (1.0 / flight + 2.0 * f_n * contact_steps)
    return Landing(
        contact_steps=jax.device_put(np.asarray(contact_steps)),
        flight_step=jax.device_put(np.asarray(flight)),
        most_steps=1024 * math.ceil(steps / 1024 + 1),
    )


@soon_compiled
def _up_to(integrator: Landing, system: System, ts, state, length) -> Trajectory:
    """Motion of the system as the only one of a batch, over so many of the times."""
    state = jnp.concatenate([state, jnp.zeros(system.own_size)])
    alone = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], system)
    return integrator.batch(alone, ts[None], state[None], length[None])
