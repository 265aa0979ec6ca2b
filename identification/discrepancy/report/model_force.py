"""What the two models push with along the recorded motion, so that it can be drawn beside what the records say is missing."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from identification.discrepancy.diagnosis import Diagnosis
from identification.fit import as_arrays
from identification.result import RecordFit
from vibrojax.excitation import Unforced, at_rest
from vibrojax.model import Model

Samples = Float[Array, " samples"]
_MOST = 8000
"""Samples that are looked at."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Force:
    """Forces on the hammer towards the stop at samples in free flight, N; all of shape (samples,).

    Attributes:
        t: s.
        u: m.
        v: m/s.
        difference: all that the augmented model pushes with, less all that the nominal one does.
    """

    t: Float[np.ndarray, " samples"]
    u: Float[np.ndarray, " samples"]
    v: Float[np.ndarray, " samples"]
    difference: Float[np.ndarray, " samples"]


def model_force(diagnosis: Diagnosis) -> Force | None:
    """Forces of both models along the fitted motion.

    None where the effects have no force in flight that time and motion alone decide: without effects, with states of their own, or with
    something of its own in each record.
    """
    effects = diagnosis.model.effects
    if not effects or diagnosis.model.record_parameters or any(one.own_states or one.record is not None for one in effects):
        return None
    t, u, v = (np.concatenate(parts) for parts in zip(*map(_flight, diagnosis.augmented.records), strict=True))
    if not len(t):
        return None
    chosen = np.linspace(0, len(t) - 1, _MOST).round().astype(int)  # of one length whatever the records: compiled once
    t, u, v = t[chosen], u[chosen], v[chosen]
    models = tuple(map(as_arrays, (diagnosis.model, dataclasses.replace(diagnosis.model, effects=()), diagnosis.nominal_model)))
    whole, without, nominal = map(np.asarray, _forces(models, jnp.asarray(t), jnp.asarray(u), jnp.asarray(v)))
    if np.abs(whole - without).max() == 0.0:
        return None
    return Force(t=t, u=u, v=v, difference=whole - nominal)


def _flight(record: RecordFit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, u and u' out of contact, where the model was run."""
    usable = ~record.in_contact & np.isfinite(record.relative_displacement) & np.isfinite(record.relative_velocity)
    return record.time[usable], record.relative_displacement[usable], record.relative_velocity[usable]


@eqx.filter_jit
def _forces(models: tuple[Model, ...], t: Samples, u: Samples, v: Samples) -> tuple[Samples, ...]:
    """Mass times relative acceleration of every model under a cart at rest, out of reach of the stop."""
    nothing, apart = jnp.zeros((len(t), 0)), jnp.zeros(len(t), bool)
    systems = [model.system(gap=1e3, base=at_rest(), applied=Unforced()) for model in models]
    return tuple(system.mass * system.forces(t, u, v, nothing, apart, jnp.zeros(len(t))).acceleration for system in systems)
