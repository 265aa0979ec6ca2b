"""The rig of the pictures: one record with an effect, as the recorder shows it and as the nominal model has it."""

import dataclasses
import functools

import jax.numpy as jnp
import numpy as np

from vibrojax.channels import UNITS, channels
from vibrojax.contact import AbstractContactLaw, HuntCrossley
from vibrojax.effects import AbstractEffect
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear

MASS, GAP = 0.5, 1e-3
SUSPENSION = Linear(damping_ratio=0.02, natural_frequency_hz=5.0)
LAW = HuntCrossley(impact_stiffness=2e6, impact_exponent=1.5, impact_damping=0.3)
BASE = Harmonic(base_amplitude=2e-3, base_phase=0.4, frequency_hz=8.0)
START = (-2e-3, 0.05)
"""u, m; u', m/s."""
NOISE = {"m": 1e-5, "m/s^2": 0.05, "N": 0.15}
"""Standard deviation of a sensor by the unit of its channel."""
_SEED = 7


@dataclasses.dataclass(frozen=True, kw_only=True)
class Run:
    """One record of the rig, SI, each array of shape (samples,)."""

    time: np.ndarray
    u: np.ndarray
    v: np.ndarray
    indentation: np.ndarray
    """Into the stop as the nominal model has it."""
    in_contact: np.ndarray
    recorded: dict[str, np.ndarray]
    nominal: dict[str, np.ndarray]
    """The same channels as the nominal model gives them along this motion."""

    def misfit(self, channel: str) -> np.ndarray:
        """Recorded less nominal, in the channel's unit."""
        return self.recorded[channel] - self.nominal[channel]

    @property
    def missing_force(self) -> np.ndarray:
        """Force on the hammer that the nominal model lacks, N."""
        return MASS * self.misfit("hammer_acceleration")

    @property
    def flight(self) -> np.ndarray:
        """Samples away from the stop in front."""
        return ~self.in_contact & (self.indentation < 0)

    @property
    def touches(self) -> np.ndarray:
        """First sample of each contact."""
        return 1 + np.flatnonzero(~self.in_contact[:-1] & self.in_contact[1:])


def simulate(effects: tuple[AbstractEffect, ...], law: AbstractContactLaw, duration: float, sampling: float) -> Run:
    """A record of the rig with these effects."""
    ts = jnp.arange(0.0, duration, sampling)

    def rig(*acting: AbstractEffect):
        return Model(mass=MASS, suspension=SUSPENSION, law=law, effects=acting).system(gap=GAP, base=BASE, applied=Unforced())

    path = Landing(most_steps=200_000)(rig(*effects), ts, jnp.asarray(START))
    if int(path.result) != SUCCESS:
        raise ArithmeticError(f"the rig with {[effect.name for effect in effects]} was not integrated: result {int(path.result)}")
    plain = dataclasses.replace(path, own=jnp.zeros((len(ts), 0)))
    rng = np.random.default_rng(_SEED)
    shown = {name: np.asarray(values) for name, values in channels(rig(*effects), path).items()}
    return Run(
        time=np.asarray(ts),
        u=np.asarray(path.u),
        v=np.asarray(path.v),
        indentation=np.asarray(path.u) - GAP,
        in_contact=np.asarray(path.in_contact),
        recorded={name: values + NOISE[UNITS[name]] * rng.standard_normal(len(ts)) for name, values in shown.items()},
        nominal={name: np.asarray(values) for name, values in channels(rig(), plain).items()},
    )


@functools.cache
def complete(duration: float, sampling: float) -> Run:
    """The record of the rig without any effect."""
    return simulate((), LAW, duration, sampling)
