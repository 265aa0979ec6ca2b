"""Sample of the posterior about a fit."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool

from identification.least_squares.uncertainty import Uncertainty
from identification.likelihood.fitted import Fitted
from identification.likelihood.sampling.density import density
from identification.likelihood.sampling.nuts import Nuts
from identification.result.posterior import PosteriorSample, diagnosed
from vibrojax.errors import InputError


def posterior_sample(
    of: Fitted, known: Bool[np.ndarray, " parameters"], spread: Uncertainty, method: Nuts, *, seed: int, progress: Callable[[str], None]
) -> PosteriorSample:
    """Sample the likelihood of a fit over its identifiable parameters.

    Args:
        of: the fit.
        known: parameters that are identifiable and not at a bound; the others keep their values.
        spread: their covariance.
        method: the sampler.
        seed: of every random draw.
        progress: called with a line of text now and then.

    Raises:
        InputError: there is none.
    """
    parameters = of.prepared.layout.parameters
    if not known.any():
        raise InputError(
            "there is no posterior to sample: no parameter is estimated, identifiable and off its bounds; leave the posterior out"
        )
    shared = len(parameters)
    about = density(of, known, spread.covariance[:shared, :shared])
    chains = method(about, int(known.sum()), seed=seed, progress=progress)
    internal = np.asarray(about.mode) + chains.draws @ np.asarray(about.scale).T
    chosen = [(index, p) for index, p in enumerate(parameters) if known[index]]
    return diagnosed(
        tuple(p.name for _, p in chosen),
        tuple(p.unit for _, p in chosen),
        draws=np.stack([np.exp(internal[..., i]) if p.logarithmic else internal[..., i] * p.scale for i, p in chosen], axis=-1),
        log_density=chains.log_density,
        divergent=chains.divergent,
        acceptance=chains.acceptance,
        steps=chains.steps,
    )
