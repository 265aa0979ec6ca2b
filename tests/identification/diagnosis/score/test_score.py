"""The score test under noise and random force alone, and with windows that were lost."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import kstest

from identification.diagnosis.score.score import information, projector, reduced, score
from identification.diagnosis.score.signature import signatures
from identification.least_squares.fit import integrator_for
from identification.likelihood.linearised import linearised
from identification.likelihood.noise import autoregression, white
from identification.likelihood.random_force import RandomForce, hats
from identification.likelihood.response import force_responses, response
from tests.effects.start import at_start
from vibrojax.effects import EFFECTS

DRAWS = 60
PUSH = dataclasses.replace(at_start(EFFECTS["constant_force"]), constant_force=1e-3)
RANDOM = RandomForce(std=0.05, memory=0.02)
COLOURED = autoregression(0.8 ** np.arange(2.0))


@pytest.fixture(scope="module")
def column(motion):
    """What a constant force shows."""
    (perturbed,) = signatures(motion.at, motion.courses, motion.prepared.layout.files, [PUSH])
    return response(motion.at, motion.mass, perturbed)


@pytest.fixture(scope="module")
def unpulled(motion):
    """The example without what is known of its gaps beforehand, which no draw of noise contains."""
    nuisances = motion.estimate.nuisances * np.array([1.0, 1.0, 0.0])
    return dataclasses.replace(
        motion, point=dataclasses.replace(motion.point, estimate=dataclasses.replace(motion.estimate, nuisances=nuisances))
    )


def drawn(motion, rng, *, force: RandomForce | None, coloured: bool):
    """Windows with noise of unit variance, of which each sample is 0.8 of the one before if coloured, and a random force."""
    noise = rng.standard_normal(motion.at.residual.shape)
    if coloured:
        noise[:, 1:] *= 0.6
        for sample in range(1, noise.shape[1]):
            noise[:, sample] += 0.8 * noise[:, sample - 1]
    residual = np.where(motion.at.weight > 0, noise, 0.0)
    if force is not None:
        places = motion.point.variances.places
        at_knots = rng.standard_normal((len(residual), len(places))) @ force.root(places).T
        residual = residual + np.einsum("lk,lktc->ltc", at_knots, force_responses(motion.at, motion.mass, hats(motion.at, places)))
    return dataclasses.replace(motion.at, residual=residual)


@pytest.mark.parametrize(
    ("force", "coloured"),
    [
        pytest.param(None, False, marks=pytest.mark.thorough, id="white"),
        pytest.param(RANDOM, False, marks=pytest.mark.thorough, id="force"),
        pytest.param(RANDOM, True, id="force and colour"),
    ],
)
def test_what_the_likelihood_knows_of_gives_gains_of_chi_square(unpulled, column, force, coloured):
    rng, gains = np.random.default_rng(11), []
    noise = dict.fromkeys(unpulled.at.channels, COLOURED if coloured else white())
    for _ in range(DRAWS):
        fitted = unpulled.fitted(drawn(unpulled, rng, force=force, coloured=coloured), force=force, noise=noise)
        by = projector(fitted)
        total, matrix = information(by, reduced(by, column[:, None]))
        gains.append(total[0] ** 2 / matrix[0, 0])
    assert kstest(gains, "chi2", args=(1,)).pvalue > 0.01


@pytest.mark.parametrize("coloured", [False, True])
def test_a_force_and_colour_that_the_likelihood_does_not_know_of_pass_for_an_effect(unpulled, column, coloured):
    """Control of the test above."""
    at = drawn(unpulled, np.random.default_rng(11), force=RANDOM, coloured=coloured)
    by = projector(unpulled.fitted(at))
    total, matrix = information(by, reduced(by, column[:, None]))
    assert total[0] ** 2 / matrix[0, 0] > 30.0


@pytest.mark.parametrize("force", [None, RANDOM], ids=["white", "force"])
def test_a_force_is_found_at_its_strength(motion, force):
    fitted = motion.fitted(motion.shown(force=0.05), force=force)
    (found,) = score(motion.prepared, projector(fitted), motion.courses, [(PUSH,)], motion.mass)
    assert found.factors[0] * 1e-3 == pytest.approx(0.05, rel=0.1)
    assert (found.gain > 1e3) == (force is None)


def test_a_window_that_was_lost_takes_nothing_from_the_others(motion):
    states = motion.estimate.states.copy()
    states[3] = np.nan
    at = linearised(motion.prepared, integrator_for(motion.prepared), dataclasses.replace(motion.estimate, states=states))
    assert not at.finite[3] and at.finite.sum() == len(at.finite) - 1
    assert all(np.isfinite(getattr(at, name)).all() for name in ("u", "v", "acceleration", "push", "own", "residual", "jacobian"))
    shown = dataclasses.replace(motion.shown(force=0.05), finite=at.finite)
    (found,) = score(motion.prepared, projector(motion.fitted(shown)), motion.courses, [(PUSH,)], motion.mass)
    assert found.gain > 100.0
    assert found.factors[0] * 1e-3 == pytest.approx(0.05, rel=0.05)
