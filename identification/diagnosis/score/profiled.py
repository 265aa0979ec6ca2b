"""Expected gain of candidates with the random force estimated anew beside each (profile likelihood of the linearised model)."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.signature import Course, signatures
from identification.least_squares import block_arrow
from identification.likelihood.fitted import Fitted
from identification.likelihood.marginal import Marginal, grams, marginal
from identification.likelihood.random_force import RandomForce
from identification.likelihood.response import response
from identification.likelihood.variances import Variances, equations, orderly, restricted_likelihood

_SMALLER = (1.0, 0.5, 0.2, 0.08, 0.02)
"""Grid: size of the force relative to that of the model without the candidate."""
_MEMORIES = 3
"""Grid: further correlation times of the force, from one interval between knots to the longest window."""


_WORTH = 1.0
"""Score gain below which a candidate is smaller than its own standard error, and keeps that gain."""


def profiled(fitted: Fitted, courses: tuple[Course, ...], best: Mapping[str, Candidate]) -> dict[str, Candidate]:
    """The best candidate of every kind, with the larger of its score gain and its profiled gain.

    The score test holds the random force at its size beside the model without the candidate. Where that force has taken up what the
    candidate explains, the score test expects less than a fit with the candidate gains.
    """
    chosen = {name: one for name, one in best.items() if one.gain > _WORTH}
    if not chosen or not is_resolved(fitted):
        return dict(best)
    changes = np.stack([change_of(fitted, one, courses) for one in chosen.values()], axis=1)
    one_sided = np.array([one.degrees == 1 and not one.members[0].probe.either_sign for one in chosen.values()])
    gains = profiled_gains(fitted, changes, one_sided)
    more = {
        name: dataclasses.replace(one, gain=max(one.gain, float(gain))) for (name, one), gain in zip(chosen.items(), gains, strict=True)
    }
    return dict(best) | more


def change_of(fitted: Fitted, candidate: Candidate, courses: tuple[Course, ...]) -> Float[np.ndarray, "windows time channels"]:
    """First-order change of the residual due to a candidate at its strength."""
    at = fitted.point.without_force()
    files, mass = fitted.prepared.layout.files, float(fitted.model.mass)
    shown = [response(at, mass, signatures(at, courses, files, [member])[0]) for member in candidate.members]
    per_record = any(p.per_record for p in candidate.members[0].parameters)
    factors = candidate.factors.reshape(len(shown), -1)[:, np.searchsorted(np.unique(at.record), at.record) if per_record else [0]]
    return np.asarray(sum(factor[:, None, None] * column for factor, column in zip(factors, shown, strict=True)))


def profiled_gains(
    fitted: Fitted,
    changes: Float[np.ndarray, "windows candidates time channels"],
    one_sided: Bool[np.ndarray, " candidates"],
) -> Float[np.ndarray, " candidates"]:
    """Twice the gain in log-likelihood of the linearised model with each candidate, the random force estimated anew, and all else refitted.

    2 max over (sigma, tau) of L + (c' P r)^2 / (2 c' P c), less 2 max L; L is the restricted likelihood and P its projection
    (`restricted_likelihood`), sigma and tau the size and correlation time of the force, from a grid.

    Args:
        fitted: the model without the candidates.
        changes: c, change of the residual due to each candidate, of any size.
        one_sided: whether only a positive multiple of the change makes sense.

    Source: D. A. Harville, JASA 72 (1977) 320-338.
    """
    here, variances = fitted.point, orderly(fitted.variances)
    at = here.without_force()
    wide = dataclasses.replace(at, jacobian=np.concatenate([at.jacobian, changes], axis=1))
    inner = grams(wide, here.answer, variances.noise, here.inner.force)
    size = 1 + at.jacobian.shape[1]
    narrow = dataclasses.replace(inner, fit=inner.fit[:, :size, :size], cross=inner.cross[..., :size])
    without, beside = [], []
    for force in _grid(variances):
        trial = dataclasses.replace(variances, force=force)
        likelihood = restricted_likelihood(here.linear, narrow, trial)
        without.append(likelihood)
        beside.append(likelihood + 0.5 * _falls(fitted, marginal(inner, trial.root), trial, size, one_sided))
    return 2.0 * (np.max(beside, axis=0) - np.max(without))


def is_resolved(fitted: Fitted) -> bool:
    """Whether the random force is above the noise in any window."""
    root = fitted.variances.root
    return bool(np.trace(root.T @ fitted.point.inner.force @ root, axis1=1, axis2=2).max() > 1.0)


def _grid(variances: Variances) -> list[RandomForce]:
    force, places = variances.force, variances.places
    memories = [force.memory, *np.geomspace(places[1], places[-1], _MEMORIES)]
    return [RandomForce(std=share * force.std, memory=float(memory)) for share in _SMALLER for memory in memories]


def _falls(
    fitted: Fitted, by: Marginal, variances: Variances, size: int, one_sided: Bool[np.ndarray, " candidates"]
) -> Float[np.ndarray, " candidates"]:
    """(c' P r)^2 / c' P c of each candidate; zero where the best multiple has the wrong sign."""
    gram = by.gram
    plain = _quadratic(fitted, gram[:, :size, :size], by, variances)
    falls = np.zeros(gram.shape[1] - size)
    for index in range(len(falls)):
        up, down = (_quadratic(fitted, _moved(gram, size, size + index, sign), by, variances) for sign in (1.0, -1.0))
        slope, curvature = 0.25 * (up - down), 0.5 * (up + down) - plain
        if curvature > 1e-9 * max(abs(plain), 1.0) and not (one_sided[index] and slope > 0):
            falls[index] = slope**2 / curvature
    return falls


def _moved(gram: np.ndarray, size: int, column: int, factor: float) -> np.ndarray:
    """Inner products with r + factor c in place of r."""
    found = gram[:, :size, :size].copy()
    added = factor * gram[:, column, :size]
    found[:, 0, :] += added
    found[:, :, 0] += added
    found[:, 0, 0] += factor**2 * gram[:, column, column]
    return found


def _quadratic(fitted: Fitted, gram: np.ndarray, by: Marginal, variances: Variances) -> float:
    """r' P r, with all unknowns at their optimum."""
    here = fitted.point
    found = equations(here.linear, dataclasses.replace(by, gram=gram), variances.weight * here.at.finite)
    reduced = block_arrow.reduce(found, here.estimate, here.linear.active, 0.0)
    return 2.0 * found.total(here.estimate) - block_arrow.newton_decrement(reduced, found)
