"""Solution of the chain's equations, in time proportional to the samples: a step, its covariance, and the marginal likelihood.

A banded Cholesky factorisation eliminates the knots, records are then eliminated one by one, and the shared unknowns are left. Another
random force changes only the equations of motion: those of the readings are added up once.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed. (2013), sections 4.3 (banded Cholesky) and 4.5 (block elimination); D. A.
Harville, Maximum likelihood approaches to variance component estimation, J. Am. Stat. Assoc. 72 (1977) 320-338 (restricted likelihood).
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky_banded, get_lapack_funcs
from scipy.optimize import lsq_linear

from identification.trajectory.chain_equations import Sums, Weighed, motion_covariance
from identification.trajectory.motion import Estimate
from identification.trajectory.random_force import RandomForce
from identification.trajectory.start import Problem

_UNKNOWN = 1e8
"""Variance, in the natural scale, of what the records say nothing of."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Solution:
    """Solution of the chain's equations: a step from the estimate, its covariance, and -2 log of the marginal likelihood.

    Attributes:
        deviance: -2 log marginal (restricted) likelihood, up to a constant of the records.
        shared: step, in units of `Border.shared_scale`; (parameters,).
        own: step, in units of `Border.own_scale`; (records, own).
        knots: step of states and force; (knots, states + 1).
        covariance: of the shared unknowns, scaled; (parameters, parameters), 0 where held.
        information, gradient: what each record by itself says of the shared unknowns, all else eliminated, scaled; (records, parameters,
            parameters) and (records, parameters), priors left out.
        own_error: standard error of each record's own unknowns, scaled; (records, own).
        factor: banded lower Cholesky factor of the knots' Hessian; (3 (states + 1), knots (states + 1)).
        by_shared, by_own: inverse of that Hessian times its border; (knots (states + 1), parameters) and (..., own).
        own_inverse: covariance of each record's own unknowns with the shared ones held; (records, own, own).
        own_by_shared: fall of these with the shared ones; (records, own, parameters).
        precision: of the shared step, scaled: the information of all records, priors, and what is assumed about the estimate.
    """

    deviance: float
    shared: np.ndarray
    own: np.ndarray
    knots: np.ndarray
    covariance: np.ndarray
    information: np.ndarray
    gradient: np.ndarray
    own_error: np.ndarray
    factor: np.ndarray
    by_shared: np.ndarray
    by_own: np.ndarray
    own_inverse: np.ndarray
    own_by_shared: np.ndarray
    precision: np.ndarray
    _rows: np.ndarray

    @property
    def knots_by_outside(self) -> np.ndarray:
        """Derivative of the knots by shared and own unknowns, scaled; (knots (states + 1), shared + own)."""
        return -np.concatenate([self.by_shared, self.by_own], axis=1)

    @property
    def outside_covariance(self) -> np.ndarray:
        """Of shared and own unknowns of each record, scaled; (records, shared + own, shared + own)."""
        across = -self.own_by_shared @ self.covariance
        shared = np.broadcast_to(self.covariance, (len(across), *self.covariance.shape))
        own = self.own_inverse - across @ self.own_by_shared.swapaxes(1, 2)
        return np.concatenate([np.concatenate([shared, across.swapaxes(1, 2)], axis=2), np.concatenate([across, own], axis=2)], axis=1)

    def within(self, least: np.ndarray, most: np.ndarray) -> "Solution":
        """The best step with the shared unknowns between limits, scaled."""
        rounding = 1e-9  # in the natural scale
        if not np.any((self.shared < least - rounding) | (self.shared > most + rounding)):
            return self
        values, vectors = np.linalg.eigh(self.precision)
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        step = np.clip(lsq_linear(root, root @ self.shared, (least - rounding, most + rounding), method="bvls").x, least, most)
        change = step - self.shared
        of_own = -self.own_by_shared @ change
        knots = self.by_shared @ change + (self.by_own * of_own[self._rows]).sum(axis=1)
        return dataclasses.replace(self, shared=step, own=self.own + of_own, knots=self.knots - knots.reshape(self.knots.shape))

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A sample of the posterior, as steps of shared, own and knots."""
        root = _root(self.covariance)
        shared = root @ rng.standard_normal(len(root))
        own = np.stack([_root(one) @ rng.standard_normal(len(one)) for one in self.own_inverse]) - self.own_by_shared @ shared
        noise = rng.standard_normal(self.factor.shape[1])
        (solve_triangular,) = get_lapack_funcs(("tbtrs",), (self.factor,))
        chain, _ = solve_triangular(self.factor, noise[:, None], uplo="L", trans="T")
        knots = chain[:, 0] - self.by_shared @ shared - (self.by_own * own[self._rows]).sum(axis=1)
        return self.shared + shared, self.own + own, self.knots + knots.reshape(self.knots.shape)


def solved(problem: Problem, at: Estimate, local: Weighed, force: RandomForce) -> Solution:
    """The solution of a problem's linearised equations under a random force."""
    found, border, chains = _eliminated(problem, at, local, force), problem.border, problem.chains
    size, shared, records = len(problem.unknowns.states) + 1, len(problem.unknowns.shared), len(chains.knots)
    (solve_triangular,) = get_lapack_funcs(("tbtrs",), (found.factor,))
    columns, _ = solve_triangular(found.factor, found.half, uplo="L", trans="T")
    x, xs, xo = columns[:, 0], columns[:, 1 : 1 + shared], columns[:, 1 + shared :]
    ss, gs, go, lead, inverse = found.shared, found.shared_gradient, found.own_gradient, found.own_by_shared, found.own_inverse
    covariance = _inverse(ss)
    precision = ss + border.proximal * np.eye(shared)
    step = -(np.linalg.solve(precision, gs) if border.proximal > 0.0 else covariance @ gs)
    own_step = -np.einsum("rop,rp->ro", inverse, go) - lead @ step
    rows = np.repeat(np.arange(records), [size * (one.stop - one.start) for one in chains.knots])
    knots = -x - xs @ step
    knots[size:] -= (xo[size:] * own_step[rows]).sum(axis=1)
    held = np.where(border.shared, 1.0, 0.0)
    own_variance = np.diagonal(inverse, axis1=1, axis2=2) + np.einsum("ros,st,rot->ro", lead, covariance * np.outer(held, held), lead)
    return Solution(
        deviance=found.deviance,
        shared=step * held,
        own=own_step * border.own,
        knots=knots[size:].reshape(-1, size),
        covariance=covariance * np.outer(held, held),
        information=found.information,
        gradient=found.gradient,
        own_error=np.sqrt(np.maximum(own_variance, 0.0)) * border.own,
        factor=found.factor[:, size:],
        by_shared=xs[size:],
        by_own=xo[size:],
        own_inverse=inverse * (border.own[:, :, None] & border.own[:, None, :]),
        own_by_shared=lead * border.own[:, :, None],
        precision=precision,
        _rows=rows,
    )


def deviance(problem: Problem, at: Estimate, local: Weighed, force: RandomForce) -> float:
    """-2 log of the marginal likelihood under a random force, without the solution."""
    return _eliminated(problem, at, local, force).deviance


class _Eliminated(NamedTuple):
    """The equations with knots and then each record's own unknowns eliminated.

    Attributes:
        deviance: see `Solution`.
        factor: banded lower Cholesky factor of the knots' Hessian.
        half: its inverse times gradient, shared and own border; (size (knots + 1), 1 + shared + own).
        shared, shared_gradient: information and gradient of the shared unknowns, with their priors.
        own_gradient, own_inverse, own_by_shared: of each record's own unknowns.
        information, gradient: see `Solution`.
    """

    deviance: float
    factor: np.ndarray
    half: np.ndarray
    shared: np.ndarray
    shared_gradient: np.ndarray
    own_gradient: np.ndarray
    own_inverse: np.ndarray
    own_by_shared: np.ndarray
    information: np.ndarray
    gradient: np.ndarray


def _eliminated(problem: Problem, at: Estimate, local: Weighed, force: RandomForce) -> _Eliminated:
    border, chains = problem.border, problem.chains
    size, shared = len(problem.unknowns.states) + 1, len(problem.unknowns.shared)
    sums = local.sums(chains, size)
    band, rhs, products = sums.band.copy(), sums.rhs.copy(), sums.border.copy()
    square, logs = _with_motion(problem, at, local, force, sums, band, rhs, products)
    band[0, :size] = 1.0
    initial, log_initial = _initial_states(problem, at, local, force, band, rhs[0])
    square, logs = square + initial, logs + log_initial
    factor = _factorised(band)
    (solve_triangular,) = get_lapack_funcs(("tbtrs",), (factor,))
    half, _ = solve_triangular(factor, rhs.T, uplo="L", trans="N")
    edges = [size * (1 + one.start) for one in chains.knots] + [len(half)]
    gradient_square = float(half[:, 0] @ half[:, 0])
    for record, (begin, end) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        products[record] -= half[begin:end].T @ half[begin:end]
    a, b = slice(1, 1 + shared), slice(1 + shared, None)
    ss, oo, os, gs, go = products[:, a, a], products[:, b, b], products[:, b, a], products[:, 0, a], products[:, 0, b]

    own_precision, own_off = border.own_precision * border.own_scale**2, (at.own - border.own_mean) / border.own_scale
    shared_precision, shared_off = border.shared_precision * border.shared_scale**2, (at.shared - border.shared_mean) / border.shared_scale
    places = np.arange(oo.shape[1])
    oo[:, places, places] += np.where(border.own, own_precision, 1.0)
    go += np.where(border.own, own_precision * own_off, 0.0)
    square += float(np.sum(np.where(border.own, own_precision * own_off**2, 0.0)))
    inverse = np.linalg.inv(oo)
    lead = inverse @ os
    information, gradients = ss - os.swapaxes(1, 2) @ lead, gs - (go[:, None, :] @ lead)[:, 0]
    total, gradient = information.sum(axis=0), gradients.sum(axis=0)
    total[np.diag_indices(shared)] += np.where(border.shared, shared_precision, 1.0)
    gradient = gradient + np.where(border.shared, shared_precision * shared_off, 0.0)
    square += float(np.sum(np.where(border.shared, shared_precision * shared_off**2, 0.0)))
    fitted = gradient_square + float(np.einsum("ro,rop,rp->", go, inverse, go)) + float(gradient @ _inverse(total) @ gradient)
    if square - fitted < -1e-6 * square:
        raise np.linalg.LinAlgError("a sum of squares came out negative: rounding has spoilt the factorisation")
    restricted, marginal = border.shared & ~border.strengths, ~border.own_strengths
    known = total[np.ix_(restricted, restricted)] + np.eye(int(restricted.sum())) / _UNKNOWN
    log_border = np.linalg.slogdet(oo[:, marginal][:, :, marginal])[1].sum() + np.linalg.slogdet(known)[1]
    return _Eliminated(
        deviance=float(square - fitted + 2.0 * float(np.log(factor[0]).sum()) + logs + float(log_border)),
        factor=factor,
        half=half,
        shared=total,
        shared_gradient=gradient,
        own_gradient=go,
        own_inverse=inverse,
        own_by_shared=lead,
        information=information,
        gradient=gradients,
    )


def _with_motion(
    problem: Problem,
    at: Estimate,
    local: Weighed,
    force: RandomForce,
    sums: Sums,
    band: np.ndarray,
    rhs: np.ndarray,
    products: np.ndarray,
) -> tuple[float, float]:
    """Add the equations of motion and of the random force; sum of squares and log determinant, those of the readings included."""
    chains, size = problem.chains, len(problem.unknowns.states) + 1
    root, knots = np.linalg.cholesky(motion_covariance(chains, problem.scales, force, problem.mass(at))), chains.left + 1
    rows, factor = sums.defect.copy(), np.ones((root.shape[1], root.shape[2], sums.defect.shape[-1]))
    factor[..., knots] = root.transpose(1, 2, 0)
    for state in range(len(rows)):
        if state == 1:  # u and u' move together; every other state has a floor of its own
            rows[1] -= factor[1, 0] * rows[0]
        rows[state] /= factor[state, state]
    inner, by_knot, right = 2 * size, band.reshape(len(band), -1, size), rhs.reshape(len(rhs), -1, size)
    for i in range(inner):
        for j in range(i + 1):
            product = np.einsum("sk,sk->k", rows[:, i], rows[:, j])
            by_knot[i - j, j // size :, j % size] += product[: len(product) - j // size]
        for column, j in enumerate((rows.shape[1] - 1, *range(inner, rows.shape[1] - 1))):
            product = np.einsum("sk,sk->k", rows[:, i], rows[:, j])
            right[column, i // size :, i % size] += product[: len(product) - i // size]
    outer = np.concatenate([rows[:, -1:], rows[:, inner:-1]], axis=1)
    for record, one in enumerate(chains.knots):
        part = outer[:, :, one.start + 1 : one.stop + 1].transpose(1, 0, 2).reshape(outer.shape[1], -1)
        products[record] += part @ part.T
    correlation, variance = force.step(chains.duration)
    jump = at.force[chains.left + 1] - correlation * at.force[chains.left]
    here, there = size * knots + size - 1, size * knots + inner - 1
    band[0, there] += 1.0 / variance
    band[0, here] += correlation**2 / variance
    band[size, here] -= correlation / variance
    rhs[0, there] += jump / variance
    rhs[0, here] -= correlation * jump / variance
    square = local.square + float((rows[:, -1] ** 2).sum() + (jump**2 / variance).sum())
    moved = np.diagonal(root[local.linked], axis1=1, axis2=2)
    logs = local.log_determinant + float(2.0 * np.log(moved).sum() + np.log(variance).sum())
    return square, logs + len(chains.knots) * 2.0 * float(np.log(force.std))


def _initial_states(
    problem: Problem, at: Estimate, local: Weighed, force: RandomForce, band: np.ndarray, gradient: np.ndarray
) -> tuple[float, float]:
    """Add the prior at the first knot of every record: motion of any size, states of effects near rest, a force of its stationary size.

    Where a segment could not be integrated, the motion at its end is of any size again, and states of effects are of their own.

    Returns:
        Sum of squares, and log determinant of the states: without it a model would gain by the unit of a state that an effect brings.
    """
    chains, scales, size = problem.chains, problem.scales, len(problem.unknowns.states) + 1
    begins, lost = np.array([one.start for one in chains.knots]), 1 + chains.left[~local.linked]
    anew = np.concatenate([begins, lost])
    stds = np.concatenate([np.tile(scales.widest, (len(begins), 1)), np.tile(scales.unknown, (len(lost), 1))])
    added = 0.0
    for place, std in enumerate(stds.T):
        band[0, size * (1 + anew) + place] += 1.0 / std**2
        if place >= 2:  # the prior of the motion is centred wherever the estimate is: it only keeps the equations definite
            gradient[size * (1 + anew) + place] += at.states[anew, place] / std**2
            added += float((at.states[anew, place] ** 2 / std**2).sum())
    band[0, size * (1 + begins) + size - 1] += 1.0 / force.std**2
    gradient[size * (1 + begins) + size - 1] += at.force[begins] / force.std**2
    return added + float((at.force[begins] ** 2).sum()) / force.std**2, 2.0 * float(np.log(stds).sum())


def _factorised(band: np.ndarray) -> np.ndarray:
    """Banded Cholesky factor of a Hessian; where rounding of large entries hides a small one, its diagonal is raised by a little more."""
    most = 1e-12
    for raised in (0.0, 1e-14, 1e-13, most):  # a few times the rounding error
        try:
            return cholesky_banded(np.concatenate([band[:1] * (1.0 + raised), band[1:]]), lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            if raised == most or not np.all(np.isfinite(band)):
                raise
    raise AssertionError


def _inverse(information: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """Inverse of an information matrix. Unknowns that it says nothing of get a variance of `_UNKNOWN`.

    Its eigenvalues are those of the matrix scaled to a diagonal of one, and are not below a few times the rounding error.
    """
    known = 0.5 * (information + information.T) + np.eye(len(information)) / _UNKNOWN
    size = np.sqrt(np.maximum(np.diag(known), 1.0 / _UNKNOWN))
    values, vectors = np.linalg.eigh(known / np.outer(size, size))
    root = vectors / np.sqrt(np.maximum(values, 1e-15)) / size[:, None]
    return root @ root.T


def _root(covariance: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """A square root of a covariance, which may be singular."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return vectors * np.sqrt(np.maximum(values, 0.0))
