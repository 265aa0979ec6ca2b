"""Fit with a smoothed contact law: Diffrax along whole records, optax over the unknowns; beside the chain, a check of it.

loss = half the sum of squares of the whitened residuals, and of what is known beforehand over its standard deviation.

An independent check of the chain: shared are the rig, its records and its unknowns, but neither the landing on the stop nor the equations
of knots. With the width of the contact switch the estimates come to those of a chain without a random force.

Source: P. Kidger, On neural differential equations, PhD thesis, Oxford 2021 (differentiating the solver); J. Nocedal, S. J. Wright,
Numerical Optimization, 2nd ed. (2006), ch. 3.5 (zoom line search) and ch. 7.2 (L-BFGS).
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import lax
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from identification.guesses.declared_model import check_smoothing
from identification.trajectory.fit import Progress
from identification.trajectory.motion import Estimate, linearise, read, segment_system
from identification.trajectory.reading_error import ReadingError, whitening
from identification.trajectory.segments import Hosted, Segments, chains_of
from identification.trajectory.start import Problem
from vibrojax.compiling import soon_compiled
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import SUCCESS
from vibrojax.integrate import Smoothed as Integrator
from vibrojax.model import Model

_LARGEST_ERROR = 0.1
"""Of a start that is off by the resolution of the sensors, over the size of the motion: a longer stretch is cut."""
SMALL_GRADIENT = 1e-4
"""Gradient in units of standard errors, which is the distance to the optimum, below which the iteration has converged."""
_OPTIMISER = optax.lbfgs(scale_init_precond=False, linesearch=optax.scale_by_zoom_linesearch(20, initial_guess_strategy="one"))
"""One object, so that nothing compiles twice; the coordinates are natural ones, in which the first step has the right length."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Smoothed:
    """Estimate with a smoothed contact law.

    Attributes:
        values: shared parameters by name, SI.
        estimate: all unknowns; states at the knots are those of the motion, the random force is the one that was held.
        converged: whether the optimum is near, against the standard errors.
    """

    values: dict[str, float]
    estimate: Estimate
    converged: bool


class _Stretches(eqx.Module):
    """Stretches of one length, side by side: segments in a row that are integrated in one go."""

    segments: Segments
    knots: Hosted
    """(stretches, knots) of the chain under each; the last one again where the record ends before."""
    end: Hosted
    """(stretches,) last knot of the record, or of the stretch, s."""
    force: Hosted
    """(stretches, knots) N"""
    touched: Hosted
    """(stretches, states - 2) speed at the last touch before the start, where it is a state, m/s."""
    lags: Hosted
    """(stretches, samples, channels, order)"""
    scale: Hosted
    """(stretches, samples, channels), as in `Whitening`."""


class _Unknowns(eqx.Module):
    """What is sought, as changes in natural sizes from where the fit began."""

    shared: Float[Hosted, " parameters"]
    own: Float[Hosted, "records own"]
    starts: tuple[Float[Hosted, "_ 2"], ...]
    """By group of stretches."""


class _Fixed(eqx.Module):
    """What a loss depends on beside its unknowns: numbers only, so that another width or record does not compile again."""

    model: Model
    integrator: Integrator
    stretches: tuple[_Stretches, ...]
    begin: _Unknowns
    size: _Unknowns
    free: _Unknowns
    mean: _Unknowns
    precision: _Unknowns
    lower: Float[Hosted, " parameters"]
    upper: Float[Hosted, " parameters"]


def fit_smoothed(
    problem: Problem,
    at: Estimate,
    *,
    smoothing: float,
    readings: tuple[ReadingError, ...] = (),
    progress: Progress = lambda line: None,
) -> Smoothed:
    """Fit a problem with the contact switch spread over a width, by L-BFGS with a zoom line search.

    A record is one motion from one initial state; where that diverges, it is cut into stretches with initial states of their own, which are
    not joined. The gradient comes in forward mode: a stretch depends on some ten unknowns, however many there are in all.

    Args:
        problem: of an experiment.
        at: where to begin, a chain's estimate or `problem.start`; its random force acts and is held. Samples are taken as equidistant.
        smoothing: width of the contact switch, m, short against the indentation.
        readings: errors of the channels, as the chain found them; white ones of the declared size where left out.
        progress: called with a line in each iteration.

    Raises:
        InputError: the width is no length, the stop is rigid, or the model has effects or filters, which this integrator does not know.
        NoConvergenceError: Diffrax cannot integrate a record.
    """
    check_smoothing(problem.model.law, smoothing)
    if problem.model.acting:
        raise InputError("the smoothed integrator integrates neither effects nor filters: expected none; use the landing integrator")
    fixed = _fixed(problem, at, smoothing, readings or tuple(ReadingError() for _ in problem.chains.channels))
    unknowns, files = problem.unknowns, problem.chains.files
    point, iterations, loss, gradient = jax.tree.map(jnp.zeros_like, fixed.begin), 0, np.inf, np.inf
    for _ in range(5):  # preconditioners, each for up to twenty iterations
        value, slope, root = _preconditioned(unknowns, files, fixed, point, problem.border.proximal)
        flat, unravel = ravel_pytree(point)
        x, state = jnp.zeros_like(flat), _OPTIMISER.init(jnp.zeros_like(flat))
        loss, gradient, count = float(value), float(jnp.abs(slope).max()), 0
        if not np.isfinite(gradient):
            raise NoConvergenceError(
                "the motion with the smoothed contact cannot be integrated: expected a nearer start, or a wider smoothing"
            )
        while gradient > SMALL_GRADIENT and count < 20:
            before = loss
            x, state, value, slope = _step(unknowns, files, fixed, (point, root), x, state, value, slope)
            loss, gradient, count = float(value), float(jnp.abs(slope).max()), count + 1
            progress(f"iteration {iterations + count}: loss {loss:.6g}, distance {gradient:.2g} standard errors")
            if not loss < before:
                break
        iterations, point = iterations + count, unravel(flat + root @ x)
        if gradient <= SMALL_GRADIENT:
            break
    estimate = _estimate(problem, at, fixed, point)
    return Smoothed(values=problem.values(estimate), estimate=estimate, converged=gradient <= SMALL_GRADIENT)


def _lengths(problem: Problem, at: Estimate) -> list[int]:
    """Segments of a stretch, by record: as many as the longest record has, halved until no stretch diverges."""
    chains, sizes = problem.chains, problem.scales.states[:2]
    linear = linearise(problem.model_at(at), problem.unknowns, chains, problem.integrator, at, problem.scales.states)
    through = np.where(linear.done[:, None, None], linear.end_by[:, :2, :2] * sizes / sizes[:, None], np.eye(2))
    limit = _LARGEST_ERROR * problem.scales.displacement / problem.scales.resolution
    longest = max(knots.stop - knots.start for knots in chains.knots) - 1
    found = []
    for record in range(len(chains.knots)):
        length, own = longest, through[chains.record == record]
        while length > 1 and max(_growth(own[begin : begin + length]) for begin in range(0, len(own), length)) > limit:
            length = -(-length // 2)
        found.append(length)
    return found


def _growth(through: Float[np.ndarray, "segments 2 2"]) -> float:
    """Largest factor by which a change of the start grows along some segments."""
    product, largest = np.eye(2), 1.0
    for one in through:
        product = one @ product
        largest = max(largest, float(np.linalg.norm(product, 2)))
    return largest


def _stretches(problem: Problem, at: Estimate, readings: tuple[ReadingError, ...]) -> tuple[_Stretches, ...]:
    """The records cut anew, a group for each length and kind of excitation."""
    chains, found, lengths = problem.chains, [], np.array(_lengths(problem, at))
    order = max(one.order for one in readings)
    for length in np.unique(lengths):
        chosen = np.flatnonzero(lengths == length)
        cut = chains_of([problem.experiment.records[record] for record in chosen], chains.samples * int(length))
        within = np.concatenate([np.arange(one.stop - one.start - 1) for one in cut.knots])  # number of a stretch in its record
        for group in cut.groups:
            record = chosen[group.record]
            begin, stop = (np.array([getattr(knots, name) for knots in chains.knots])[record] for name in ("start", "stop"))
            first = begin + length * within[group.place]
            knots = np.minimum(first[:, None] + np.arange(length + 1), stop[:, None] - 1)
            last = chains.samples * (knots[:, -1] - first)
            errors = [readings[chains.channels.index(name)] for name in cut.channels]
            counted, start = group.weight > 0, np.ones(len(record), bool)
            white = [whitening(error, counted[..., c], start) for c, error in enumerate(errors)]
            found.append(
                _Stretches(
                    segments=dataclasses.replace(group, record=record),
                    knots=knots,
                    end=np.take_along_axis(group.ts, last[:, None], axis=1)[:, 0],
                    force=at.force[knots],
                    touched=at.states[first, 2:],
                    lags=np.stack([np.pad(one.lags, ((0, 0), (0, 0), (0, order - one.lags.shape[-1]))) for one in white], axis=2),
                    scale=np.stack([one.scale for one in white], axis=2),
                )
            )
    return tuple(found)


def _fixed(problem: Problem, at: Estimate, smoothing: float, readings: tuple[ReadingError, ...]) -> _Fixed:
    """The loss at an estimate."""
    border, stretches, tolerance = problem.border, _stretches(problem, at, readings), 1e-10  # of a step; the gradient is then better known
    starts = tuple(at.states[one.knots[:, 0], :2] for one in stretches)
    own_size = np.broadcast_to(border.own_scale, at.own.shape)
    fixed = _Fixed(
        model=problem.model_at(at),
        integrator=Integrator(smoothing=smoothing, rtol=tolerance, atol=1e-3 * tolerance, longest_step=problem.integrator.flight_step),
        stretches=stretches,
        begin=_Unknowns(at.shared, at.own, starts),
        size=_Unknowns(border.shared_scale, own_size, tuple(np.broadcast_to(problem.scales.states[:2], one.shape) for one in starts)),
        free=_Unknowns(1.0 * border.shared, 1.0 * border.own, tuple(np.ones_like(one) for one in starts)),
        mean=_Unknowns(border.shared_mean, border.own_mean, starts),
        precision=_Unknowns(border.shared_precision, border.own_precision, tuple(np.zeros_like(one) for one in starts)),
        lower=border.lower,
        upper=border.upper,
    )
    return jax.tree.map(jnp.asarray, fixed)


def _moved(fixed: _Fixed, point: _Unknowns) -> _Unknowns:
    """Unknowns in SI or logarithms; what is held stays, and limits are kept."""
    moved = jax.tree.map(lambda begin, size, free, step: begin + size * free * step, fixed.begin, fixed.size, fixed.free, point)
    return dataclasses.replace(moved, shared=jnp.clip(moved.shared, fixed.lower, fixed.upper))


def _vectors(fixed: _Fixed, point: _Unknowns) -> tuple[Float[Array, "_ columns"], ...]:
    """What each stretch depends on, in the order of `segment_system`."""
    at, found = _moved(fixed, point), []
    for one, starts in zip(fixed.stretches, at.starts, strict=True):
        shared = jnp.broadcast_to(at.shared, (len(starts), len(at.shared)))
        found.append(jnp.concatenate([starts, one.touched, one.force, shared, at.own[one.segments.record]], axis=1))
    return tuple(found)


def _along(unknowns, files, fixed: _Fixed, one: _Stretches, vector: Float[Array, " columns"]):
    """The rig of a stretch and its motion to the knot at the end."""
    system = segment_system(fixed.model, unknowns, files, one.segments, vector)
    ts = jnp.minimum(one.segments.ts, one.end)
    return system, fixed.integrator(system, ts, vector[: len(unknowns.states)])


def _residual(unknowns, files, fixed: _Fixed, one: _Stretches, vector: Float[Array, " columns"]) -> Float[Array, "samples channels"]:
    """Whitened residuals of a stretch; infinite where it could not be integrated."""
    system, motion = _along(unknowns, files, fixed, one, vector)
    samples = jax.tree.map(lambda leaf: leaf[:-1] if jnp.ndim(leaf) else leaf, motion)
    predicted = read(unknowns, one.segments, system, samples, vector)
    counted = one.segments.weight > 0
    residual = jnp.where(counted, jnp.where(counted, predicted, 0.0) - one.segments.measured, 0.0) * one.segments.weight
    white = residual
    for lag in range(1, one.lags.shape[-1] + 1):
        white = white.at[lag:].add(-one.lags[lag:, :, lag - 1] * residual[:-lag])
    return jnp.where(motion.result == SUCCESS, white * one.scale, jnp.inf)


def _swept(unknowns, files, fixed: _Fixed, stretches: _Stretches, vectors: Float[Array, "stretches columns"]):
    """Half the sum of squares of each stretch, its gradient and its Gauss-Newton Hessian, by one forward sweep."""
    border = len(unknowns.shared) + len(unknowns.own)
    sought = np.r_[0:2, vectors.shape[1] - border : vectors.shape[1]]
    directions = jnp.zeros((len(sought), vectors.shape[1])).at[np.arange(len(sought)), sought].set(1.0)

    def sweep(lane):
        one, vector = lane
        function = lambda moved: _residual(unknowns, files, fixed, one, moved)  # noqa: E731
        value, by = jax.vmap(lambda direction: jax.jvp(function, (vector,), (direction,)), out_axes=(None, 0))(directions)
        flat = by.reshape(len(sought), -1)
        return 0.5 * jnp.sum(value**2), (flat @ value.ravel()) @ directions, flat @ flat.T

    value, gradient, gram = lax.map(sweep, (stretches, vectors))
    return value, gradient, jnp.einsum("ia,lij,jb->lab", directions, gram, directions)


def _loss(unknowns, files, fixed: _Fixed, point: _Unknowns) -> Float[Array, ""]:
    """Loss of a point, which reverse mode differentiates by the forward sweep of every stretch."""

    @jax.custom_vjp
    def squares(vectors):
        return slopes(vectors)[0]

    def slopes(vectors):
        found = [_swept(unknowns, files, fixed, one, vector)[:2] for one, vector in zip(fixed.stretches, vectors, strict=True)]
        return sum(jnp.sum(value) for value, _ in found), tuple(gradient for _, gradient in found)

    squares.defvjp(slopes, lambda gradients, by: (tuple(by * one for one in gradients),))
    return squares(_vectors(fixed, point)) + _known(fixed, point)


def _known(fixed: _Fixed, point: _Unknowns) -> Float[Array, ""]:
    """Half the squared distance to what is known beforehand."""
    off = jax.tree.map(
        lambda one, mean, precision: jnp.sum(precision * (one - mean) ** 2), _moved(fixed, point), fixed.mean, fixed.precision
    )
    return 0.5 * jnp.sum(jnp.stack(jax.tree.leaves(off)))


@soon_compiled
def _preconditioned(unknowns, files, fixed: _Fixed, point: _Unknowns, proximal: float):
    """Loss, gradient and coordinates x, point + root x, in which the Gauss-Newton Hessian is the identity: x counts standard errors."""
    flat, unravel = ravel_pytree(point)
    vectors = _vectors(fixed, point)
    slopes = jax.jacfwd(lambda moved: _vectors(fixed, unravel(moved)))(flat)
    known = lambda moved: _known(fixed, unravel(moved))  # noqa: E731
    value, gradient, hessian = known(flat), jax.grad(known)(flat), jax.hessian(known)(flat) + proximal * jnp.eye(len(flat))
    for one, vector, slope in zip(fixed.stretches, vectors, slopes, strict=True):
        squares, by, gram = _swept(unknowns, files, fixed, one, vector)
        value, gradient = value + squares.sum(), gradient + jnp.einsum("la,lap->p", by, slope)
        hessian = hessian + jnp.einsum("lap,lab,lbq->pq", slope, gram, slope)
    root = jnp.linalg.inv(jnp.linalg.cholesky(hessian)).T
    return value, root.T @ gradient, root


@soon_compiled
def _step(unknowns, files, fixed: _Fixed, coordinates, x, state, value, gradient):
    """One iteration of L-BFGS."""
    point, root = coordinates
    flat, unravel = ravel_pytree(point)
    loss = lambda moved: _loss(unknowns, files, fixed, unravel(flat + root @ moved))  # noqa: E731
    with jax.numpy_dtype_promotion("standard"):  # optax counts in 32 bits beside 64
        updates, state = _OPTIMISER.update(gradient, state, x, value=value, grad=gradient, value_fn=loss)
    found = [optax.tree_utils.tree_get(state, name) for name in ("value", "grad")]
    return optax.apply_updates(x, updates), state, *found


@soon_compiled
def _motions(unknowns, files, fixed: _Fixed, point: _Unknowns):
    """u and u' of every stretch at its samples and at the knot behind them."""
    lanes = zip(fixed.stretches, _vectors(fixed, point), strict=True)
    motions = [lax.map(lambda lane: _along(unknowns, files, fixed, *lane)[1], lane) for lane in lanes]
    return [jnp.stack([motion.u, motion.v], axis=-1) for motion in motions]


def _estimate(problem: Problem, at: Estimate, fixed: _Fixed, point: _Unknowns) -> Estimate:
    """A point as an estimate of the chain."""
    found, states = _moved(fixed, point), at.states.copy()
    for one, motion in zip(fixed.stretches, _motions(problem.unknowns, problem.chains.files, fixed, point), strict=True):
        knots, along = np.asarray(one.knots), np.asarray(motion)[:, :: problem.chains.samples]
        states[knots, :2] = along  # of a knot between two stretches the start of the second: the last one counts
    return Estimate(states=states, force=at.force, shared=np.asarray(found.shared), own=np.asarray(found.own))
