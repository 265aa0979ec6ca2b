"""Residuals of all windows and their derivatives; only this module calls the solver in a fit."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from identification.windows.layout import NUISANCES, STATES, Layout
from identification.windows.windows import Windows
from vibrojax.channels import channels
from vibrojax.compiling import soon_compiled
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, AbstractBatchIntegrator, Guided, Trajectory
from vibrojax.model import Model
from vibrojax.system import System

_INTERPOLATED = 2
"""Samples after an instant that an interpolation uses."""


class Normal(eqx.Module):
    """Cost, gradient and Gauss-Newton matrix of every window."""

    hessian: Float[Array, "lanes size size"]
    gradient: Float[Array, "lanes size"]
    cost: Float[Array, " lanes"]
    """Half the sum of squared residuals; infinite where the integration failed."""


def lane_system(model: Model, layout: Layout, lane: Windows, local: Float[Array, " size"]) -> System:
    """The rig in one window, built from that window's vector of unknowns."""
    shared, (amplitude, phase, gap_error, *others) = local[: layout.shared], local[layout.shared : -layout.states]
    variations, others = others[len(layout.zeros) :][: len(layout.variations)], others[len(layout.zeros) + len(layout.variations) :]
    for (name, std), value in zip(layout.variations, variations, strict=True):
        shared = shared.at[layout.index(name)].add(std * value)
    estimated = zip((*layout.parameters, *layout.record_parameters), (*shared, *others), strict=True)
    values = {p.name: jnp.exp(value) if p.logarithmic else value * p.scale for p, value in estimated}
    base = lane.motion
    if base is None:
        base = Harmonic(base_amplitude=amplitude, base_phase=phase, frequency_hz=lane.frequency_hz)
    applied = Unforced() if lane.applied is None else lane.applied
    if lane.disturbance is not None:
        applied = dataclasses.replace(lane.disturbance, beside=applied)

    def acts(file: str) -> Float[Array, ""] | float:
        return jnp.where(lane.record == layout.files.index(file), 1.0, 0.0) if file in layout.files else 0.0

    return model.replace(values).in_record(acts).system(gap=lane.gap + gap_error, base=base, applied=applied)


def initial_states(layout: Layout, local: Float[Array, "lanes size"]) -> Float[Array, "lanes states"]:
    """u, u' and the effects' own states at the start of every window; states that are not estimated start at rest."""
    own = jnp.zeros((local.shape[0], len(layout.own_states)), local.dtype)
    begin = local[:, layout.size - layout.states :]
    own = own.at[:, jnp.asarray(layout.free_own, int)].set(begin[:, len(STATES) :])
    return jnp.concatenate([begin[:, : len(STATES)], own], axis=1)


def predict(
    model: Model, layout: Layout, integrator: AbstractBatchIntegrator, windows: Windows, local: Float[Array, "lanes size"]
) -> tuple[Float[Array, "lanes time channels"], Trajectory]:
    """Model channels of every window, in the order of `windows.channels`, and the trajectories."""
    systems = jax.vmap(lambda lane, vector: lane_system(model, layout, lane, vector))(windows, local)
    states = initial_states(layout, local)
    if windows.prescribed is None:
        trajectory = integrator.batch(systems, windows.ts, states, _reach(systems, windows))
        lanes = eqx.tree_at(lambda t: t.steps, trajectory, jnp.broadcast_to(trajectory.steps, windows.lengths.shape))
    else:
        lanes = jax.vmap(lambda motion, *where: Guided(motion)(*where))(windows.prescribed, systems, windows.ts, states)
        trajectory = eqx.tree_at(lambda t: t.steps, lanes, lanes.steps[0])
    readings = jax.vmap(channels)(systems, lanes)
    for place, (name, scale) in enumerate(layout.zeros, start=layout.shared + len(NUISANCES)):
        readings[name] = readings[name] + scale * local[:, place, None]
    return jnp.stack([readings[name] for name in windows.channels], axis=-1), trajectory


def _reach(systems: System, windows: Windows) -> Int[Array, " lanes"]:
    """Number of samples to integrate in each window: its own and one more for interpolation, or as many as its last ones require."""
    further = jnp.zeros(windows.lengths.shape)
    last = jnp.take_along_axis(windows.ts, windows.lengths[:, None] - 1, axis=1)
    for effect in systems.effects:
        further = jnp.maximum(further, -lax.stop_gradient(effect.lateness(last[:, 0])))
    needed = jnp.sum(windows.ts <= last + further[:, None], axis=1) + _INTERPOLATED
    return jnp.minimum(jnp.where(further > 0, needed, windows.lengths + 1), windows.ts.shape[1])


def weighted_residual(
    model: Model, layout: Layout, integrator: AbstractBatchIntegrator, windows: Windows, local: Float[Array, "lanes size"]
) -> tuple[Float[Array, "lanes time channels"], Trajectory]:
    """r = (measured - model) / sigma, zero where nothing counts, and the trajectories."""
    predicted, trajectory = predict(model, layout, integrator, windows, local)
    counted = windows.weight > 0
    return jnp.where(counted, (windows.measured - predicted) * windows.weight, 0.0), trajectory


@soon_compiled
def residuals(model: Model, layout: Layout, integrator: AbstractBatchIntegrator, windows: Windows, local: Float[Array, "lanes size"]):
    """Compiled `weighted_residual`, with each window's result code."""
    residual, trajectory = weighted_residual(model, layout, integrator, windows, local)
    return residual, trajectory.result


@soon_compiled
def normal_equations(
    model: Model, layout: Layout, integrator: AbstractBatchIntegrator, windows: Windows, local: Float[Array, "lanes size"]
) -> Normal:
    """Cost, gradient and Gauss-Newton matrix of every window, by forward-mode differentiation with respect to its own vector.

    Windows share no state, so one sweep with `size` tangents gives the derivatives of all of them.
    """

    def motion(vector):
        residual, trajectory = weighted_residual(model, layout, integrator, windows, vector)
        return residual, trajectory.result

    def along(direction):
        return jax.jvp(motion, (local,), (jnp.broadcast_to(direction, local.shape),), has_aux=True)

    residual, derivative, result = jax.vmap(along, out_axes=(None, 1, None))(jnp.eye(layout.size))
    lanes = residual.shape[0]
    flat, jacobian = residual.reshape(lanes, -1), derivative.reshape(lanes, layout.size, -1)
    cost = jnp.where(result == SUCCESS, 0.5 * jnp.sum(flat**2, axis=1), jnp.inf)
    return Normal(
        hessian=jnp.einsum("lis,ljs->lij", jacobian, jacobian),
        gradient=jnp.einsum("lis,ls->li", jacobian, flat),
        cost=cost,
    )
