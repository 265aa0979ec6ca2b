"""Linearised motion: residuals, Jacobian, fundamental matrix and force derivatives of every window, by forward differentiation."""

import dataclasses
import functools
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped
from scipy.linalg import expm

from identification.least_squares.fit import CHUNK, as_arrays, on_device
from identification.least_squares.residual import lane_system, predict
from identification.likelihood.noise import Autoregression, runs
from identification.windows.lanes import chunked
from identification.windows.layout import Estimate, Layout
from identification.windows.prepare import Prepared
from identification.windows.windows import FITTED_CHANNELS, Windows
from vibrojax.compiling import soon_compiled
from vibrojax.excitation import PiecewiseLinearForce
from vibrojax.integrate import AbstractBatchIntegrator
from vibrojax.model import Model
from vibrojax.system import System

_SINGULAR = 1e-12
"""Determinant of a state derivative, scaled to largest element 1, below which it is singular; cut-off of its singular values."""
_FORGOTTEN = 1e-6
"""The same below which the initial state counts as forgotten: the derivatives have an error of about this size."""
_STICKS = 0.05
"""Share of the velocity that is forgotten from sample to sample above which the hammer sticks."""
_LARGEST = 1e100
"""Largest residual or derivative, over the noise, of a window that counts as integrated."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Linearised:
    """Every window linearised at one point of the fit; the first axis is the window, time is padded to the longest.

    Attributes:
        record: index of each window's record.
        first: index of its first sample there.
        lengths: count of its samples.
        ts: their times, s; (windows, time).
        weight: 1 / noise of every sample and channel, 0 where it does not count; (windows, time, channels).
        channels: names along the last axis.
        residual: (measured - model) / noise; (windows, time, channels).
        jacobian: derivative of the residual with respect to the window's own vector; (windows, size, time, channels).
        u, v: displacement and velocity of the hammer relative to the cart; (windows, time).
        acceleration, push: absolute acceleration of the hammer, and force of the stop; (windows, time).
        in_contact, approach_speed: as in `Trajectory`.
        own: states of the effects in the model; (windows, time, own).
        fundamental: derivative of the state with respect to that at the start of the window; (windows, time, states, states). The state is
            u, u' and those states of effects that are initial values of a window.
        push_by, restoring: derivatives of the push and of the hammer's absolute acceleration with respect to the state;
            (windows, time, states).
        cart_by: derivatives of the cart's displacement and acceleration with respect to the state; (windows, time, 2, states).
        flow: derivative of the state's rates with respect to the state; (windows, time, states, states).
        kick: derivative of the state's rates with respect to a force on the hammer, 1/N; (windows, time, states).
        finite: windows whose integration succeeded; all else is zero in the others.
    """

    record: np.ndarray
    first: np.ndarray
    lengths: np.ndarray
    ts: np.ndarray
    weight: np.ndarray
    channels: tuple[str, ...]
    residual: np.ndarray
    jacobian: np.ndarray
    u: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    push: np.ndarray
    in_contact: np.ndarray
    approach_speed: np.ndarray
    own: np.ndarray
    fundamental: np.ndarray
    push_by: np.ndarray
    restoring: np.ndarray
    cart_by: np.ndarray
    flow: np.ndarray
    kick: np.ndarray
    finite: np.ndarray

    @property
    def inside(self) -> Bool[np.ndarray, "windows time"]:
        """Samples that are not padding."""
        return np.arange(self.u.shape[1]) < self.lengths[:, None]

    @functools.cached_property
    def runs(self) -> Int[np.ndarray, "windows channels time"]:
        """Number of consecutive samples of each channel that end at each one, as `identification.likelihood.noise.runs` counts them."""
        return runs((self.weight > 0).transpose(0, 2, 1))

    def pieces(self, chosen: Int[np.ndarray, " chosen"], samples: Int[np.ndarray, "chosen pieces width"]) -> "Linearised":
        """Parts of some windows, by their samples, side by side along the first axis, without Jacobian.

        Derivatives stay those by the state at the start of the windows, and `first` and `lengths` are theirs.
        """
        windows, count, width = samples.shape
        lane = chosen[:, None, None]

        def cut(values: np.ndarray, samples: np.ndarray = samples) -> np.ndarray:
            return values[lane, samples].reshape(windows * count, samples.shape[-1], *values.shape[2:])

        along = ("ts", "weight", "residual", "u", "v", "acceleration", "push", "in_contact", "approach_speed", "own")
        along += ("fundamental", "push_by", "restoring", "cart_by", "flow", "kick")
        by_window = {name: np.repeat(getattr(self, name)[chosen], count, axis=0) for name in ("record", "first", "lengths", "finite")}
        nothing = np.zeros((windows * count, 0, width, len(self.channels)))
        found = dataclasses.replace(self, jacobian=nothing, **by_window, **{name: cut(getattr(self, name)) for name in along})
        before, after = (cut(part, np.minimum(samples[..., :-1], part.shape[1] - 1)) for part in self.quadrature)
        known = {"runs": cut(self.runs.transpose(0, 2, 1)).transpose(0, 2, 1), "quadrature": (before, after)}
        vars(found).update(known | {"forgetful": (np.zeros(0, int), np.zeros((0, width - 1, *self.fundamental.shape[2:])))})
        return found

    @functools.cached_property
    def quadrature(self) -> tuple[Float[np.ndarray, "windows steps states states"], Float[np.ndarray, "windows steps states states"]]:
        """Quadrature weights L and R of each step between samples: int X^-1 b dt = L b_0 + R b_1, X the fundamental matrix, b linear in it.

        The corrected trapezoidal rule uses the derivatives at both ends, d/dt X^-1 b = X^-1 (b' - A b) with A the flow: exact for a cubic.
        """
        inverse, step = _inverse(self.fundamental, self.finite), np.diff(self.ts, axis=1)[..., None, None] / 12.0
        first, last, turned = inverse[:, :-1], inverse[:, 1:], inverse @ self.flow
        before = step * (5.0 * first + last) - 12.0 * step**2 * turned[:, :-1]
        after = step * (first + 5.0 * last) + 12.0 * step**2 * turned[:, 1:]
        return before, after

    @functools.cached_property
    def forgetful(self) -> tuple[Int[np.ndarray, " forgetful"], Float[np.ndarray, "forgetful steps states states"]]:
        """Windows in which the hammer sticks until its initial state is forgotten, and the derivative of the state over each step.

        The derivative by the initial state is singular then, and what acts later does not follow from it. From there the derivative over
        a step is that of the flow, exp(A dt), with A the mean of both ends.
        """
        steps = np.diff(self.ts, axis=1, append=self.ts[:, -1:])
        sticks = ~self.in_contact & (-self.flow[..., 1, 1] * steps > _STICKS)
        windows = np.flatnonzero(self.finite & np.any(sticks & self.inside, axis=1))
        scaled, _, _ = _scaled(self.fundamental[windows], self.finite[windows])
        regular = np.abs(_determinants(scaled)) > _FORGOTTEN
        lost = ~regular & np.logical_or.accumulate(sticks[windows], axis=1)
        some = np.any(lost & self.inside[windows], axis=1) & regular[:, 0]  # a prescribed motion is singular from the start
        windows, known = windows[some], regular[some] & ~np.logical_or.accumulate(lost[some], axis=1)
        whole, flow = self.fundamental[windows], self.flow[windows]
        inverse = np.linalg.inv(np.where(known[..., None, None], whole, np.eye(whole.shape[-1])))
        found, by_flow = whole[:, 1:] @ inverse[:, :-1], ~(known[:, :-1] & known[:, 1:])
        found[by_flow] = expm(0.5 * steps[windows, :-1, None, None][by_flow] * (flow[:, :-1] + flow[:, 1:])[by_flow])
        return windows, found

    def over_noise(
        self, values: Float[np.ndarray, "windows *rows time channels"], noise: Mapping[str, Autoregression]
    ) -> Float[np.ndarray, "windows *rows channels time"]:
        """Rows of residuals, each channel whitened by the covariance of its noise."""
        found = np.empty((*values.shape[:-2], values.shape[-1], values.shape[-2]))
        for c, name in enumerate(self.channels):
            found[..., c, :] = noise[name].whitened(values[..., c], self.runs[:, c])
        return found

    def of_record(self, values: Shaped[np.ndarray, "windows time ..."], record: int, samples: int) -> Shaped[np.ndarray, "samples ..."]:
        """Values along one record, assembled from its windows."""
        whole = np.zeros((samples, *values.shape[2:]), values.dtype)
        for window in np.flatnonzero(self.record == record):
            first, length = self.first[window], self.lengths[window]
            whole[first : first + length] = values[window, :length]
        return whole

    def in_windows(
        self, values: Shaped[np.ndarray, "... samples"], record: int
    ) -> tuple[Int[np.ndarray, " windows"], Shaped[np.ndarray, "... windows time"]]:
        """The windows of one record, and values along the record cut into them."""
        windows = np.flatnonzero(self.record == record)
        samples = self.first[windows, None] + np.minimum(np.arange(self.ts.shape[1]), self.lengths[windows, None] - 1)
        return windows, values[..., samples]


def disturbed(groups: tuple[Windows, ...], estimate: Estimate, places: Float[np.ndarray, " knots"]) -> tuple[Windows, ...]:
    """Windows under the estimated random force; `places` are its knots from the start of each window, s."""
    found, begin = [], 0
    for group in groups:
        lanes = len(group.record)
        spacing = np.full(lanes, places[1] - places[0])
        force = PiecewiseLinearForce(start=group.ts[:, 0], spacing=spacing, values=estimate.force[begin : begin + lanes])
        found.append(dataclasses.replace(group, disturbance=force))
        begin += lanes
    return tuple(found)


def linearised(
    prepared: Prepared, integrator: AbstractBatchIntegrator, estimate: Estimate, places: Float[np.ndarray, " knots"] | None = None
) -> Linearised:
    """Integrate every window with the tangents of its own vector; under the estimated random force if `places`, its knots, are given."""
    model, layout, local = as_arrays(prepared.model), prepared.layout, estimate.local(prepared.record)
    groups = prepared.groups if places is None else disturbed(prepared.groups, estimate, places)
    chunks = chunked(groups, CHUNK)
    seen = tuple(name for name in FITTED_CHANNELS if any(name in group.channels for group in groups))

    def part(chunk: tuple[np.ndarray, Windows]):
        lanes, windows = chunk
        found = _tangents(model, layout, integrator, on_device(windows), jnp.asarray(local[lanes]))
        found = {name: np.asarray(array) for name, array in found.items()}
        spread = {name: _among(found[name], windows.channels, seen) for name in ("residual", "jacobian")}
        return lanes, found | spread

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        found = list(threads.map(part, chunks))
    whole = {name: np.empty((len(prepared.record), *array.shape[1:]), array.dtype) for name, array in found[0][1].items()}
    for lanes, values in found:
        for name, array in values.items():
            whole[name][lanes] = array
    finite = whole.pop("finite") & _moderate(whole["residual"]) & _moderate(whole["jacobian"])
    whole = {name: array if array.dtype == bool else _only_finite(array, finite) for name, array in whole.items()}
    lengths = np.concatenate([group.lengths for group in groups])
    longest = int(lengths.max())
    return Linearised(
        record=prepared.record,
        first=np.concatenate([group.first for group in groups]),
        lengths=lengths,
        ts=np.concatenate([group.ts for group in groups])[:, :longest],
        weight=np.concatenate([_among(group.weight, group.channels, seen) for group in groups])[:, :longest],
        channels=seen,
        finite=finite,
        **{name: array[:, :, :longest] if name == "jacobian" else array[:, :longest] for name, array in whole.items()},
    )


def _among(values: np.ndarray, channels: tuple[str, ...], seen: tuple[str, ...]) -> np.ndarray:
    """Values of some channels (last axis) arranged among all recorded channels; zero for the others."""
    if channels == seen:
        return values
    found = np.zeros((*values.shape[:-1], len(seen)), values.dtype)
    found[..., [seen.index(name) for name in channels]] = values
    return found


def _inverse(
    matrices: Float[np.ndarray, "windows time states states"], finite: Bool[np.ndarray, " windows"]
) -> Float[np.ndarray, "windows time states states"]:
    """Inverse of every matrix; pseudoinverse of a singular one."""
    scaled, size, largest = _scaled(matrices, finite)
    singular = np.abs(_determinants(scaled)) < _SINGULAR
    found = np.linalg.inv(np.where(singular[..., None, None], np.eye(len(size)), scaled))
    found[singular] = np.linalg.pinv(scaled[singular], rcond=_SINGULAR)
    return found / largest * size[:, None] / size


def _scaled(
    matrices: Float[np.ndarray, "windows time states states"], finite: Bool[np.ndarray, " windows"]
) -> tuple[Float[np.ndarray, "windows time states states"], Float[np.ndarray, " states"], Float[np.ndarray, "windows time 1 1"]]:
    """Every matrix in units of the states' sensitivity to the first initial value, over its largest element; these units and elements."""
    size = np.sqrt(np.mean(matrices[finite, ..., 0] ** 2, axis=(0, 1))) if finite.any() else np.zeros(matrices.shape[-1])
    size = np.where(size > 0, size, 1.0)
    scaled = matrices * size / size[:, None]
    largest = np.abs(scaled).max(axis=(-2, -1), keepdims=True)
    largest = np.where(largest > 0, largest, 1.0)
    return scaled / largest, size, largest


def _determinants(matrices: Float[np.ndarray, "*stack states states"]) -> Float[np.ndarray, "*stack"]:
    with np.errstate(divide="ignore"):  # of a matrix that is exactly singular
        return np.asarray(np.linalg.det(matrices))


def _moderate(values: np.ndarray) -> Bool[np.ndarray, " windows"]:
    """Windows whose values are all finite and far from overflow when squared."""
    axes = tuple(range(1, values.ndim))
    return np.maximum(values.max(axis=axes, initial=0.0), -values.min(axis=axes, initial=0.0)) <= _LARGEST


def _only_finite(values: np.ndarray, finite: np.ndarray) -> np.ndarray:
    """Values set to zero where the integration failed or a derivative overflowed."""
    with np.errstate(invalid="ignore", over="ignore"):
        total = values.sum()
    if not np.isfinite(total):
        values = np.nan_to_num(values, posinf=0.0, neginf=0.0)
    values[~finite] = 0.0
    return values


@soon_compiled
def _tangents(
    model: Model, layout: Layout, integrator: AbstractBatchIntegrator, windows: Windows, local: Float[Array, "lanes size"]
) -> dict[str, Array]:
    """Residual, Jacobian, motion and state derivatives of some windows."""
    free = jnp.asarray(layout.free_own, int)

    def run(vector: Float[Array, "lanes size"]):
        predicted, trajectory = predict(model, layout, integrator, windows, vector)
        residual = jnp.where(windows.weight > 0, (windows.measured - predicted) * windows.weight, 0.0)
        return (residual, trajectory.u, trajectory.v, trajectory.own[..., free]), trajectory

    def along(direction):
        return jax.jvp(run, (local,), (jnp.broadcast_to(direction, local.shape),), has_aux=True)

    (residual, u, v, own), (jacobian, *moved), trajectory = jax.vmap(along, out_axes=(None, 1, None))(jnp.eye(layout.size))
    systems = jax.vmap(lambda lane, vector: lane_system(model, layout, lane, vector))(windows, local)
    begin = layout.size - layout.states
    du, dv, down = (one[:, begin:] for one in moved)
    fundamental = jnp.concatenate([jnp.stack([du, dv], axis=-1), down], axis=-1)

    def acting(state: Float[Array, "lanes time states"], force: Float[Array, ""]):
        """Absolute acceleration, push, cart motion and state rates at every instant, with an additional constant force."""

        def at(system: System, ts, state, own, *contact):
            beside = PiecewiseLinearForce(start=0.0, spacing=1.0, values=jnp.stack([force, force]), beside=system.applied)
            whole = own.at[..., free].set(state[..., 2:])
            found = dataclasses.replace(system, applied=beside).forces(ts, state[..., 0], state[..., 1], whole, *contact)
            cart = sum((effect.base_displacement(part) for effect, part in system.each(whole)), jnp.zeros_like(found.push))
            rates = jnp.concatenate([jnp.stack([state[..., 1], found.acceleration], axis=-1), found.own_rates[..., free]], axis=-1)
            return found.absolute, found.push, jnp.stack([cart, found.absolute - found.acceleration], axis=-1), rates

        return jax.vmap(at)(systems, windows.ts, state, trajectory.own, trajectory.in_contact, trajectory.approach_speed)

    state, none = jnp.concatenate([jnp.stack([u, v], axis=-1), own], axis=-1), jnp.zeros(())
    (acceleration, push, _, _), (*_, kick) = jax.jvp(acting, (state, none), (jnp.zeros_like(state), jnp.ones(())))

    def by_state(direction: Float[Array, " states"]):
        return jax.jvp(acting, (state, none), (jnp.broadcast_to(direction, state.shape), none))[1]

    restoring, push_by, cart_by, flow = jax.vmap(by_state, out_axes=-1)(jnp.eye(layout.states))
    return {
        "residual": residual,
        "jacobian": jacobian,
        "u": u,
        "v": v,
        "acceleration": acceleration,
        "push": push,
        "in_contact": trajectory.in_contact,
        "approach_speed": trajectory.approach_speed,
        "own": trajectory.own,
        "fundamental": jnp.moveaxis(fundamental, 1, -1),
        "push_by": push_by,
        "restoring": restoring,
        "cart_by": cart_by,
        "flow": flow,
        "kick": kick,
        "finite": trajectory.result == 0,
    }
