"""The likelihood beyond its curvature at the fit: profiles of parameters, and a sample of their posterior.

Draws come from a multivariate t distribution with the covariance of the fit, which has longer tails than a normal one; each is weighted by
its density. That is of the shared parameters, with states, random force and each record's own numbers integrated out by the chain's
equations about them, flat in the coordinate of the fit and times the operator's priors. The weights are smoothed, and the shape of their
tail says whether the draws represent the posterior.

Source: A. Vehtari, D. Simpson, A. Gelman, Y. Yao, J. Gabry, J. Mach. Learn. Res. 25 (2024) 72 (Pareto smoothed importance sampling).
"""

import dataclasses

import numpy as np

from identification.estimation.parameters import Uncertainty, profile_rise
from identification.result.posterior import PosteriorSample, weighted
from identification.result.result import LikelihoodProfile, ProfileMap, Profiles
from identification.trajectory.fit import Fitted, Progress, settled
from vibrojax.errors import InputError

DRAWS, FEWEST = 400, 50
"""Draws where no count is given, and at least: the tail of the weights is read off a fifth of them."""


def profiles(fitted: Fitted, spread: Uncertainty, progress: Progress) -> Profiles:
    """Profile of every parameter with a standard error, and a map of k_i and n, or of the two most strongly correlated."""
    single, places = [], np.flatnonzero(spread.known)
    for index in places:
        progress(f"likelihood profile of {fitted.problem.parameters[index].name}")
        single.append(_profile(fitted, spread, int(index)))
    names = [fitted.problem.parameters[index].name for index in places]
    if len(names) < 2:
        return Profiles(single=tuple(single), pair=None)
    if {"k_i", "n"} <= set(names):
        first, second = (fitted.problem.unknowns.index(name) for name in ("k_i", "n"))
    else:
        correlation = np.abs(np.triu(spread.correlation(places), 1))
        first, second = (int(places[i]) for i in np.unravel_index(int(np.argmax(correlation)), correlation.shape))
    return Profiles(single=tuple(single), pair=_map(fitted, spread, (first, second), progress))


def _profile(fitted: Fitted, spread: Uncertainty, index: int) -> LikelihoodProfile:
    """Profile of one parameter, over three standard errors to either side."""
    shifts = np.linspace(-3.0, 3.0, 13) * spread.stderr[index]
    rise = tuple(profile_rise(fitted, {index: float(shift)}, steps=2) for shift in shifts)
    values = tuple(_physical(fitted, index, shift) for shift in shifts)
    return LikelihoodProfile(name=fitted.problem.parameters[index].name, values=values, rise=rise)


def _map(fitted: Fitted, spread: Uncertainty, pair: tuple[int, int], progress: Progress) -> ProfileMap:
    """Map of two parameters, along the axes of their ellipse, over 3.2 standard errors to either side."""
    first, second = (fitted.problem.parameters[index].name for index in pair)
    root = np.linalg.cholesky(spread.covariance[np.ix_(pair, pair)])
    steps, rows = np.linspace(-3.2, 3.2, 9), []
    for number, one in enumerate(steps, start=1):
        progress(f"likelihood map of {first} and {second}: row {number} of {len(steps)}")
        cells = []
        for shift in (root @ np.array([one, other]) for other in steps):
            values = (_physical(fitted, index, s) for index, s in zip(pair, shift, strict=True))
            cells.append((*values, profile_rise(fitted, dict(zip(pair, map(float, shift), strict=True)), steps=1)))
        rows.append(cells)
    along, across, rise = (tuple(tuple(cell[part] for cell in row) for row in rows) for part in range(3))
    return ProfileMap(names=(first, second), first=along, second=across, rise=rise)


def _physical(fitted: Fitted, index: int, shift: float) -> float:
    """Value of a parameter so far from the fit, in the coordinate of the fit."""
    internal = fitted.at.shared[index] / fitted.problem.border.shared_scale[index]
    return fitted.problem.parameters[index].to_physical(float(internal + shift))


def posterior_sample(fitted: Fitted, spread: Uncertainty, draws: int, *, seed: int, progress: Progress) -> PosteriorSample:
    """Sample the likelihood of a fit over its identifiable parameters; the others keep their values.

    Raises:
        InputError: no parameter is identifiable and off its bounds.
    """
    known = np.flatnonzero(spread.known & fitted.problem.border.shared)
    if not len(known):
        raise InputError(
            "there is no posterior to sample: no parameter is estimated, identifiable and off its bounds; leave the posterior out"
        )
    rng, count, tails = np.random.default_rng(seed), len(known), 7.0  # degrees of freedom of the t distribution
    root = np.linalg.cholesky(spread.covariance[np.ix_(known, known)])
    z = rng.standard_normal((draws, count)) / np.sqrt(rng.chisquare(tails, (draws, 1)) / tails)
    log_proposal = -0.5 * (tails + count) * np.log1p((z**2).sum(axis=1) / tails)
    mode = fitted.at.shared / fitted.problem.border.shared_scale
    internal = np.broadcast_to(mode, (draws, len(mode))).copy()
    internal[:, known] += z @ root.T
    log_density = np.zeros(draws)
    for number, one in enumerate(internal):
        if number % 20 == 0:  # draws between two lines
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
        there = settled(held, dataclasses.replace(fitted.at, shared=shared), fitted.variances, steps=2)
    except np.linalg.LinAlgError:
        return -np.inf
    prior = float(np.sum(border.shared_precision * (shared - border.shared_mean) ** 2))
    return -0.5 * (there.solution.deviance + prior)
