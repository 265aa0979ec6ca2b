"""Joint mode of parameters, window states and random force, integrated under the estimated force."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int

from identification.least_squares import block_arrow
from identification.least_squares.block_arrow import Equations
from identification.least_squares.fit import bounds, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import off_the_bounds
from identification.likelihood import robust
from identification.likelihood.linearised import Linearised, linearised
from identification.likelihood.marginal import Grams, Marginal, estimated_force, grams, marginal, without_force
from identification.likelihood.random_force import ForceResponse, force_response, hats
from identification.likelihood.response import force_responses
from identification.likelihood.variances import Linear, Variances, equations
from identification.windows.layout import Active, Estimate
from identification.windows.prepare import Prepared

_LOST = 1e6
"""Mean squared residual assigned to a window whose integration failed."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Point:
    """A linearised point of the fit, with its cost under given variances."""

    prepared: Prepared
    estimate: Estimate
    at: Linearised
    """With residuals under the random force."""
    answer: ForceResponse
    """Response of the residuals to the force at its knots."""
    linear: Linear
    variances: Variances
    inner: Grams
    """With residuals as without the random force."""
    marginal: Marginal
    deviation: np.ndarray
    """(windows,): squared residuals over the noise plus squared force over its covariance; infinite where the integration failed."""

    @property
    def cost(self) -> float:
        """Negative log joint density, up to constants, nats."""
        finite, degrees = np.isfinite(self.deviation), self.variances.degrees
        deviation = np.where(finite, self.deviation, self.lost)
        samples = np.where(finite, self.inner.samples, self.possible)
        return float(robust.loss(deviation, samples, degrees).sum()) + self.prior

    @property
    def possible(self) -> Int[np.ndarray, " windows"]:
        """Samples of every window, integrated or not."""
        return (self.at.weight > 0).sum(axis=(1, 2))

    @property
    def lost(self) -> Float[np.ndarray, " windows"]:
        """Squared residual assigned to a window whose integration failed."""
        return _LOST * self.possible

    @property
    def prior(self) -> float:
        """Negative log prior of effects' states, sensor zeros, variations between records and gap errors, nats."""
        return equations(self.linear, self.marginal, np.zeros(len(self.deviation))).total(self.estimate)

    def equations(self, damping: float = 0.0, *, newton: bool = False) -> Equations:
        """Normal equations under the full likelihood at this point, with the random force eliminated.

        Args:
            damping: relative increase of the force's curvature, which shortens its step.
            newton: with the curvature of the windows' robust loss.
        """
        held = damping / (1.0 + damping)
        gram = (1.0 - held) * self.marginal.gram + held * self.inner.fit
        gram[:, 1:, 0] += held * (self.inner.cross[..., 1:].transpose(0, 2, 1) @ self.estimate.force[..., None])[..., 0]
        by = dataclasses.replace(self.marginal, gram=gram)
        return equations(self.linear, by, self.weight, self._curvature(gram) if newton else None)

    def _curvature(self, gram: Float[np.ndarray, "windows vector vector"]) -> Float[np.ndarray, " windows"]:
        """Curvature of the windows' robust loss along the estimated unknowns."""
        weight, active = self.weight, self.linear.active
        own, states = active.nuisances[self.at.record], np.ones(self.estimate.states.shape, bool)
        free = np.concatenate([np.broadcast_to(active.shared, (len(weight), len(active.shared))), own, states], axis=1)
        gradient = gram[:, 1:, 0] * weight[:, None] * free
        hessian = gram[:, 1:, 1:] * weight[:, None, None] * (free[:, :, None] & free[:, None, :])
        return robust.curvature(gradient, hessian, self.inner.samples, self.variances.degrees)

    @property
    def from_force(self) -> float:
        """Expected decrease of the cost due to a step of the random force alone, nats."""
        inner, by, force = self.inner, self.marginal, self.estimate.force
        gradient = (by.root.T @ (inner.cross[..., :1] + inner.force @ force[..., None]))[..., 0] + np.linalg.solve(by.root, force.T).T
        fall = np.linalg.solve(by.factor, gradient[..., None])[..., 0]
        return 0.5 * float(self.weight @ np.sum(fall**2, axis=1))

    @property
    def weight(self) -> Float[np.ndarray, " windows"]:
        """Robust weight of every window at this point."""
        return robust.weights(self.deviation, self.inner.samples, self.variances.degrees)

    def under(self, variances: Variances) -> "Point":
        """The same point under other variances."""
        if variances.noise is self.variances.noise:
            return _weighed(self.prepared, self.estimate, self.at, self.answer, variances, self.inner.force)
        return dataclasses.replace(self, variances=variances).renewed()

    def moved(self, step: Float[np.ndarray, "windows size"], force: Float[np.ndarray, "windows knots"], variances: Variances) -> "Point":
        """The point after a step of the linear model, with that model's random force, under other variances.

        The step is rejected where it raises the cost.
        """
        layout, estimate, record = self.prepared.layout, self.estimate, self.at.record
        shared, count = step[0, : layout.shared], layout.size - layout.states
        nuisances = np.zeros_like(estimate.nuisances)
        nuisances[record] = step[:, layout.shared : count]
        moved = estimate.moved(np.clip(estimate.shared + shared, *bounds(self.prepared)) - estimate.shared, nuisances, step[:, count:])
        moved = dataclasses.replace(moved, force=np.where(self.at.finite[:, None], np.nan_to_num(force), 0.0))
        here, there = self.under(variances), point(self.prepared, moved, variances, like=self)
        return there if there.cost < here.cost else here

    def renewed(self) -> "Point":
        """The same point with the response to the random force recomputed."""
        answer = _answer(self.prepared, self.at, self.variances)
        return _weighed(self.prepared, self.estimate, self.at, answer, self.variances, None)

    def without_force(self) -> Linearised:
        """The windows with residuals as without the random force, to first order."""
        return dataclasses.replace(self.at, residual=self.at.residual - self.shown(self.estimate.force))

    def shown(self, force: Float[np.ndarray, "windows knots"]) -> Float[np.ndarray, "windows time channels"]:
        """First-order change of the residual due to a force at the knots, N."""
        force = np.where(_free(self.prepared)[:, None], force, 0.0)
        acting = np.einsum("lk,lkt->lt", force, hats(self.at, self.variances.places))
        return force_responses(self.at, float(self.prepared.model.mass), acting[:, None])[:, 0]


def point(
    prepared: Prepared,
    estimate: Estimate,
    variances: Variances,
    *,
    at: Linearised | None = None,
    like: "Point | None" = None,
    refinement: float = 1.0,
) -> Point:
    """Integrate all windows under the estimated force and linearise.

    Args:
        prepared: windows and model.
        estimate: with the force.
        variances: of noise and force.
        at: the windows linearised under the estimated force, if available.
        like: a near point under the same noise, whose response to the force is reused.
        refinement: 2 halves every step of the integration.
    """
    if at is None:
        at = linearised(prepared, integrator_for(prepared, refinement=refinement), estimate, variances.places)
    if like is not None and like.variances.noise is variances.noise:
        answer, known = like.answer, like.inner.force if np.array_equal(like.at.finite, at.finite) else None
    else:
        answer, known = _answer(prepared, at, variances), None
    return _weighed(prepared, estimate, at, answer, variances, known)


def _free(prepared: Prepared) -> Bool[np.ndarray, " windows"]:
    """Windows whose hammer moves under the forces that act on it, not along a prescribed motion."""
    return np.concatenate([np.full(len(group.record), group.prescribed is None) for group in prepared.groups])


def _answer(prepared: Prepared, at: Linearised, variances: Variances) -> ForceResponse:
    """Response to the random force; zero where the hammer follows a prescribed motion."""
    found = force_response(at, float(prepared.model.mass), variances.places, variances.noise)
    free = _free(prepared)
    return dataclasses.replace(found, near=found.near * free[:, None, None, None], state=found.state * free[:, None, None])


def _weighed(
    prepared: Prepared, estimate: Estimate, at: Linearised, answer: ForceResponse, variances: Variances, known: np.ndarray | None
) -> Point:
    """A point from its linearisation and the response to the force; `known`: inner products of that response, if available."""
    inner = without_force(grams(at, answer, variances.noise, known), estimate.force)
    found = marginal(inner, variances.root)
    white = np.linalg.solve(found.root, estimate.force.T).T
    deviation = np.where(
        at.finite, np.sum(at.over_noise(at.residual, variances.noise) ** 2, axis=(1, 2)) + np.sum(white**2, axis=1), np.inf
    )
    linear = Linear(layout=prepared.layout, estimate=estimate, active=free_unknowns(prepared), at=at)
    return Point(
        prepared=prepared,
        estimate=estimate,
        at=at,
        answer=answer,
        linear=linear,
        variances=variances,
        inner=inner,
        marginal=found,
        deviation=deviation,
    )


def _bent(here: Point, there: Point) -> Point:
    """The point with the residual that makes its linear model exact at another point: r(there) - J (step) - Z f(there), without force."""
    step = there.estimate.local(here.at.record) - here.estimate.local(here.at.record)
    moved = there.at.residual - np.einsum("ls,lstc->ltc", step, here.at.jacobian) - here.shown(there.estimate.force)
    usable, unmoved = (here.at.finite & there.at.finite)[:, None, None], here.without_force()
    at = dataclasses.replace(unmoved, residual=np.where(usable, moved, unmoved.residual))
    inner = grams(at, here.answer, here.variances.noise, here.inner.force)
    return dataclasses.replace(here, inner=inner, marginal=marginal(inner, here.variances.root))


@dataclasses.dataclass(frozen=True, kw_only=True)
class JointMode:
    """Levenberg-Marquardt iteration on the joint density at fixed variances: damped steps of parameters, states and force together.

    Steps hold the windows' weights (iteratively reweighted least squares, which decreases the cost from far away). Where the expected
    decrease exceeds that of the last step, the next one includes the curvature of the loss (Newton). A step that fails is repeated with a
    correction of second order, which follows a curved valley: where two parameters explain nearly the same, a small curvature of the
    residual outweighs what is left to gain. Where a step gains less than half of the decrease expected of an undamped one, where
    steps fail and at convergence, the response to the force is recomputed: it determines the steps only, not the cost.

    Source: M. K. Transtrum, J. P. Sethna, Improvements to the Levenberg-Marquardt algorithm (2012), arXiv:1201.5885 (geodesic
    acceleration; here the second derivative comes from the failed step).
    """

    most_iterations: int = 12
    tolerance: float = 0.1
    """Decrease of the cost below which the iteration has converged, nats."""
    longest_step: float = 0.7
    """Longest step of a shared parameter, in its internal coordinate."""

    def __call__(self, start: Point) -> Point:
        """Mode reached from a point; the cost never rises."""
        here, cost, damping, growth, fresh, newton = start, start.cost, 1e-4, 2.0, True, False
        ahead = self.to_go(here)
        for _ in range(self.most_iterations):
            if ahead < self.tolerance:
                if fresh:
                    break
                here, fresh = here.renewed(), True
                ahead = self.to_go(here)
                continue
            trial = point(here.prepared, self._step(here, damping, newton=newton), here.variances, like=here)
            if not trial.cost < cost:
                trial = point(here.prepared, self._step(_bent(here, trial), damping, newton=newton), here.variances, like=here)
            after, expected = trial.cost, ahead
            if after < cost:
                fall, here, cost, was_fresh, fresh = cost - after, trial, after, fresh, False
                damping, growth = max(damping / 10.0, 1e-9), 2.0
                ahead = self.to_go(here)
                if fall < self.tolerance and was_fresh:
                    break
                if fall < 0.5 * expected:
                    here, fresh = here.renewed(), True
                    ahead = self.to_go(here)
                newton = newton or ahead > fall
            elif newton:
                newton = False
            elif not fresh:
                here, fresh = here.renewed(), True
                ahead = self.to_go(here)
            else:
                damping, growth = damping * growth, growth * 4.0
                if damping > 1e6:
                    break
        return here

    def to_go(self, here: Point) -> float:
        """Expected decrease of the cost in an undamped Newton step, nats."""
        found = here.equations(newton=True)
        rest = block_arrow.newton_decrement(block_arrow.reduce(found, here.estimate, self._free(here, found), 0.0), found)
        return 0.5 * rest + here.from_force

    def _free(self, here: Point, found: Equations) -> Active:
        return off_the_bounds(found, here.estimate, here.linear.active, bounds(here.prepared))

    def _step(self, here: Point, damping: float, *, newton: bool) -> Estimate:
        estimate, limits = here.estimate, bounds(here.prepared)
        found = here.equations(damping, newton=newton)
        reduced = block_arrow.reduce(found, estimate, self._free(here, found), damping)
        shared, nuisances, states = block_arrow.solve(reduced, found, estimate, longest=self.longest_step)
        moved = estimate.moved(np.clip(estimate.shared + shared, *limits) - estimate.shared, nuisances, states)
        step = moved.local(here.at.record) - estimate.local(here.at.record)
        force, _ = estimated_force(here.inner, here.marginal, step)
        force = estimate.force + (force - estimate.force) / (1.0 + damping)
        return dataclasses.replace(moved, force=np.where(here.at.finite[:, None], np.nan_to_num(force), 0.0))
