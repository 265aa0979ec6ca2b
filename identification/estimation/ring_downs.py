"""Ring-downs of the records, and of models that swing from the same states, through one estimator, so that its errors cancel."""

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import root_scalar

from identification.estimation.simulate import system_in, without_faults
from identification.experiment import Experiment, Record
from identification.result.result import RecordFit, measured_displacement
from identification.result.ring_down import RingDown, RingDowns, one_flight, ring_down, together
from vibrojax.compiling import soon_compiled
from vibrojax.integrate import SUCCESS, Landing, Trajectory
from vibrojax.integrate.landing import flight_step
from vibrojax.model import Model
from vibrojax.system import System

_KINDS = ("drop-test", "free-decay")
"""Records in which nothing drives the hammer."""
_PADDED_TO = 1024
"""Samples of a simulated flight are padded to a multiple of this, so that records share a compiled program."""
_STEPS_PER_PERIOD, _STEPS_PER_OWN_PERIOD, _CONTACT_STEPS = 60.0, 24.0, 60.0
_NUDGE = 1e-4
"""Second start of the search for the place of rest, m."""
_MARGIN = 2
"""Samples beside a contact that count as contact."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Flight:
    """Samples of a record between contacts; `noise` and `level`, about which it swings, are those of the displacement, m.

    `returns`: a contact ends it; otherwise the hammer may have come to rest in it.
    """

    record: Record
    fit: RecordFit
    part: slice
    noise: float
    level: float
    returns: bool

    def ring_down(self, u: np.ndarray, frequency: float, level: float) -> tuple[RingDown | None, bool]:
        """Damping and frequency by amplitude of a motion at the flight's times, and whether it is a single swing out and back."""
        time = self.fit.time[self.part][: len(u)]
        long = ring_down(self.fit.file, time, u, noise=self.noise)
        if long is not None or not self.returns:
            return long, False
        return one_flight(self.fit.file, time, u, noise=self.noise, level=level, frequency=frequency), True


def ring_downs(experiment: Experiment, records: tuple[RecordFit, ...], models: Mapping[str, Model]) -> RingDowns:
    """Damping and frequency by amplitude of the free vibrations in the records, and of models that start from the same states.

    Predictions of the records, by the last of the models, give contacts and initial states.
    """
    left_out: dict[str, str] = {}
    flights: list[_Flight] = []
    measured: list[RingDown] = []
    best = list(models.values())[-1]
    frequency = float(best.values().get("f_n", 0.0))
    for fit in records:
        u = measured_displacement(fit)
        if experiment.suspension.kind == "free":
            left_out[fit.file] = "without a spring nothing vibrates"
        elif fit.kind not in _KINDS:
            left_out[fit.file] = "driven throughout, so that nothing decays"
        elif u is None:
            left_out[fit.file] = "its displacement was not recorded"
        if u is None or fit.file in left_out:
            continue
        found = [(one, *one.ring_down(u[one.part], frequency, one.level)) for one in _flights(experiment, fit, best)]
        flights += [one for one, points, _ in found if points is not None]
        measured += _merged((points, single) for _, points, single in found if points is not None)
        if not any(points is not None for _, points, _ in found):
            left_out[fit.file] = "no swing out and back, between impacts, that its samples resolve"
    simulated = {name: _of_model(model, flights, frequency) for name, model in models.items()}
    return RingDowns(measured=tuple(measured), models=simulated, left_out=left_out)


def _merged(found: Iterable[tuple[RingDown, bool]]) -> list[RingDown]:
    """Ring-downs of one record; its single swings as one."""
    every = list(found)
    swings = [points for points, single in every if single]
    return [points for points, single in every if not single] + ([together(swings)] if swings else [])


def _flights(experiment: Experiment, fit: RecordFit, model: Model) -> Iterator[_Flight]:
    """Flights of a record in which the motion is predicted; the model says where the hammer rests."""
    record = next(one for one in experiment.records if one.file == fit.file)
    names = ("relative_displacement",) if "relative_displacement" in fit.measured else ("hammer_displacement", "cart_displacement")
    noise = math.hypot(*(fit.noise.get(name, 0.0) for name in names))
    read = measured_displacement(dataclasses.replace(fit, measured={name: fit.predicted[name] for name in names if name in fit.measured}))
    known = np.isfinite(fit.relative_displacement) & np.isfinite(fit.relative_velocity)
    level = float(np.median((read - fit.relative_displacement)[known])) if read is not None and known.any() else 0.0
    level += rest_place(model, record)
    near = np.convolve(fit.in_contact, np.ones(2 * _MARGIN + 1), mode="same") > 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known & ~near, [False]]).astype(int)))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        yield _Flight(record=record, fit=fit, part=slice(first, end), noise=noise, level=level, returns=end < len(near) and bool(near[end]))


def _of_model(model: Model, flights: list[_Flight], frequency: float) -> tuple[RingDown, ...]:
    """The model's own ring-downs from the states in which the measured ones begin."""
    longest = max((one.part.stop - one.part.start for one in flights), default=0)
    padded = longest + -longest % _PADDED_TO
    found = [(one.fit.file, *one.ring_down(_simulated(model, one, padded), frequency, rest_place(model, one.record))) for one in flights]
    files = dict.fromkeys(file for file, _, _ in found)
    return tuple(
        each
        for file in files
        for each in _merged((points, single) for other, points, single in found if other == file and points is not None)
    )


def rest_place(model: Model, record: Record) -> float:
    """Displacement at which the suspension bears the constant forces on the hammer, clear of the stop, m; 0 where nothing bears them."""
    system = jax.tree.map(np.asarray, system_in(model, record))

    def acceleration(u: float) -> float:
        return float(_at_rest(system, np.asarray(u)))

    found = root_scalar(acceleration, x0=0.0, x1=_NUDGE, method="secant") if acceleration(0.0) != 0.0 else None
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
    f_n = float(model.values().get("f_n", 0.0))
    flight = float(flight_step(model.effects, max(f_n, 1.0 / duration), a_period=_STEPS_PER_PERIOD, an_own_period=_STEPS_PER_OWN_PERIOD))
    steps = 2.0 * duration * (1.0 / flight + 2.0 * f_n * _CONTACT_STEPS)
    return Landing(
        contact_steps=jax.device_put(np.asarray(_CONTACT_STEPS)),
        flight_step=jax.device_put(np.asarray(flight)),
        most_steps=1024 * math.ceil(steps / 1024 + 1),
    )


@soon_compiled
def _up_to(integrator: Landing, system: System, ts, state, length) -> Trajectory:
    """Motion of the system as the only one of a batch, over so many of the times."""
    state = jnp.concatenate([state, jnp.zeros(system.own_size)])
    alone = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], system)
    return integrator.batch(alone, ts[None], state[None], length[None])
