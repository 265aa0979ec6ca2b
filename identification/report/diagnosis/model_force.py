"""What the two models push with along the recorded motion, so that it can be drawn beside what the records say is missing."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from identification.diagnosis.diagnosis import Diagnosis
from identification.least_squares.fit import as_arrays
from identification.result.result import RecordFit
from vibrojax.compiling import soon_compiled
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
        indentation: m, below zero.
        difference: all that the augmented model pushes with, less all that the nominal one does.
    """

    t: Float[np.ndarray, " samples"]
    u: Float[np.ndarray, " samples"]
    v: Float[np.ndarray, " samples"]
    indentation: Float[np.ndarray, " samples"]
    difference: Float[np.ndarray, " samples"]


def model_force(diagnosis: Diagnosis) -> Force | None:
    """Forces of both models along the fitted motion.

    None where the effects have no force in flight that time and motion alone decide: without effects, with states of their own, or with
    something of its own in each record.
    """
    effects = diagnosis.model.effects
    if not effects or diagnosis.model.record_parameters or any(one.own_states or one.record is not None for one in effects):
        return None
    samples = np.concatenate([_flight(record) for record in diagnosis.augmented.records], axis=1)
    if not samples.shape[1]:
        return None
    chosen = np.linspace(0, samples.shape[1] - 1, _MOST).round().astype(int)  # of one length whatever the records: compiled once
    t, u, v, gap = samples[:, chosen]
    models = tuple(map(as_arrays, (diagnosis.model, dataclasses.replace(diagnosis.model, effects=()), diagnosis.nominal_model)))
    whole, without, nominal = map(np.asarray, _forces(models, *map(jnp.asarray, (t, u, v, gap))))
    if np.abs(whole - without).max() == 0.0:
        return None
    return Force(t=t, u=u, v=v, indentation=u - gap, difference=whole - nominal)


def _flight(record: RecordFit) -> Float[np.ndarray, "4 samples"]:
    """Time, u, u' and the gap out of contact, where the model was run."""
    u, v = record.relative_displacement, record.relative_velocity
    usable = ~record.in_contact & np.isfinite(u) & np.isfinite(v) & (u < record.gap)
    return np.stack([record.time, u, v, np.full_like(u, record.gap)])[:, usable]


@soon_compiled
def _forces(models: tuple[Model, ...], t: Samples, u: Samples, v: Samples, gap: Samples) -> tuple[Samples, ...]:
    """Mass times relative acceleration of every model under a cart at rest, out of contact."""
    nothing, apart, resting = jnp.zeros(0), jnp.asarray(False), jnp.asarray(0.0)

    def each(model: Model, *sample):
        t, u, v, gap = sample
        system = model.system(gap=gap, base=at_rest(), applied=Unforced())
        return system.mass * system.forces(t, u, v, nothing, apart, resting).acceleration

    return tuple(jax.vmap(partial(each, model))(t, u, v, gap) for model in models)
