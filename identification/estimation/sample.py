"""Sample of the posterior about a fit: draws about the mode, each weighted by its density.

The density is that of the shared parameters, with states, random force and each record's own numbers integrated out by the chain's
equations about them, flat in the coordinate of the fit and times the operator's priors. Draws come from a multivariate t distribution with
the covariance of the fit, which has longer tails than a normal one. Their weights are smoothed, and the shape of the weights' tail says
whether the draws represent the posterior.

Source: A. Vehtari, D. Simpson, A. Gelman, Y. Yao, J. Gabry, J. Mach. Learn. Res. 25 (2024) 72 (Pareto smoothed importance sampling).
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.estimation.parameters import Uncertainty
from identification.result.posterior import PosteriorSample, weighted
from identification.trajectory.fit import Fitted, settled
from vibrojax.errors import InputError

DRAWS, FEWEST = 400, 50
"""Draws where no count is given, and at least: the tail of the weights is read off a fifth of them."""
_TAILS = 7.0
"""Degrees of freedom of the t distribution."""
_STEPS = 2
"""Gauss-Newton steps of everything else for each draw."""
_EVERY = 20
"""Draws between two lines of progress."""


def posterior_sample(fitted: Fitted, spread: Uncertainty, draws: int, *, seed: int, progress: Callable[[str], None]) -> PosteriorSample:
    """Sample the likelihood of a fit over its identifiable parameters; the others keep their values.

    Args:
        fitted: the fit.
        spread: covariance of the parameters.
        draws: so many.
        seed: of every random draw.
        progress: called with a line of text now and then.

    Raises:
        InputError: no parameter is identifiable and off its bounds.
    """
    known = np.flatnonzero(spread.known & fitted.problem.border.shared)
    if not len(known):
        raise InputError(
            "there is no posterior to sample: no parameter is estimated, identifiable and off its bounds; leave the posterior out"
        )
    rng, count = np.random.default_rng(seed), len(known)
    root = np.linalg.cholesky(spread.covariance[np.ix_(known, known)])
    z = rng.standard_normal((draws, count)) / np.sqrt(rng.chisquare(_TAILS, (draws, 1)) / _TAILS)
    log_proposal = -0.5 * (_TAILS + count) * np.log1p((z**2).sum(axis=1) / _TAILS)
    mode = fitted.at.shared / fitted.problem.border.shared_scale
    internal = np.broadcast_to(mode, (draws, len(mode))).copy()
    internal[:, known] += z @ root.T
    log_density = np.zeros(draws)
    for number, one in enumerate(internal):
        if number % _EVERY == 0:
            progress(f"sampling the posterior: {number} of {draws} draws")
        log_density[number] = log_posterior(fitted, one)
    parameters = [fitted.problem.parameters[place] for place in known]
    return weighted(
        tuple(p.name for p in parameters),
        tuple(p.unit for p in parameters),
        draws=np.stack([np.vectorize(p.to_physical)(internal[:, i]) for i, p in zip(known, parameters, strict=True)], axis=-1),
        log_density=log_density,
        log_proposal=log_proposal,
    )


def log_posterior(fitted: Fitted, internal: np.ndarray) -> float:
    """Logarithm of the density of all shared parameters, in the coordinate of the fit, up to a constant; -inf beyond their range."""
    problem, border = fitted.problem, fitted.problem.border
    shared = internal * border.shared_scale
    if np.any(border.shared & ((shared < border.lower) | (shared > border.upper))):
        return -np.inf
    held = dataclasses.replace(problem, border=dataclasses.replace(border, shared=np.zeros(len(shared), bool)))
    try:
        there = settled(held, dataclasses.replace(fitted.at, shared=shared), fitted.variances, steps=_STEPS)
    except np.linalg.LinAlgError:
        return -np.inf
    prior = float(np.sum(border.shared_precision * (shared - border.shared_mean) ** 2))
    return -0.5 * (there.solution.deviance + prior)
