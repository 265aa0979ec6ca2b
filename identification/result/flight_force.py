"""Force of a model's effects in free flight, along the fitted motion."""

import dataclasses
from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from identification.result.result import RecordFit
from vibrojax.compiling import soon_compiled
from vibrojax.excitation import Unforced, at_rest
from vibrojax.model import Model

Samples = Float[Array, " samples"]
_SAMPLES = 8000
"""Number of samples, whatever the records: compiled once."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class FlightForce:
    """Motion at samples in free flight, SI, and the push of the effects towards the stop, N; all of shape (samples,)."""

    u: Float[np.ndarray, " samples"]
    v: Float[np.ndarray, " samples"]
    indentation: Float[np.ndarray, " samples"]
    added: Float[np.ndarray, " samples"]


def flight_force(records: Sequence[RecordFit], model: Model) -> FlightForce | None:
    """All that a model pushes the hammer with, less what it does without its effects.

    Args:
        records: with their fitted motion.
        model: with effects.

    Returns:
        None where the effects have no force in flight that time and motion alone decide: without effects, with states of their own, or with
        something of its own in each record.
    """
    if not model.effects or model.record_parameters or any(one.own_states or one.record is not None for one in model.effects):
        return None
    samples = np.concatenate([_flight(record) for record in records], axis=1)
    if not samples.shape[1]:
        return None
    t, u, v, gap = samples[:, np.linspace(0, samples.shape[1] - 1, _SAMPLES).round().astype(int)]
    models = tuple(one.as_arrays() for one in (model, dataclasses.replace(model, effects=())))
    whole, without = map(np.asarray, _forces(models, *map(jnp.asarray, (t, u, v, gap))))
    if np.abs(whole - without).max() == 0.0:
        return None
    return FlightForce(u=u, v=v, indentation=u - gap, added=whole - without)


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
