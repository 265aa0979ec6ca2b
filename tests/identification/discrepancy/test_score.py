"""The score test under noise alone, and with windows that were lost."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import kstest

from identification.likelihood.linearised import linearised
from identification.discrepancy.look import blank
from identification.likelihood.response import response
from identification.discrepancy.score import information, projector, reduced, score
from identification.discrepancy.signature import signatures
from identification.fit import free_unknowns, integrator_for
from vibrojax.effects import EFFECTS

DRAWS = 60


def projected(motion, at):
    return projector(motion.prepared, at, motion.estimate, free_unknowns(motion.prepared), 1.0 * at.finite)


def test_noise_gives_gains_of_chi_square(motion):
    effect = dataclasses.replace(blank(EFFECTS["constant_force"]), constant_force=1e-3)
    (perturbed,) = signatures(motion.at, motion.courses, motion.prepared.layout.files, [effect])
    column, rng, gains = response(motion.at, motion.mass, perturbed), np.random.default_rng(11), []
    no_prior = dataclasses.replace(motion.estimate, nuisances=motion.estimate.nuisances * np.array([1.0, 1.0, 0.0]))
    for _ in range(DRAWS):
        drawn = np.where(motion.at.weight > 0, rng.standard_normal(motion.at.residual.shape), 0.0)
        at = dataclasses.replace(motion.at, residual=drawn)
        by = projector(motion.prepared, at, no_prior, free_unknowns(motion.prepared), np.ones(len(at.record)))
        total, matrix = information(by, [reduced(by, column)])
        gains.append(total[0] ** 2 / matrix[0, 0])
    assert kstest(gains, "chi2", args=(1,)).pvalue > 0.01


def test_a_window_that_was_lost_takes_nothing_from_the_others(motion):
    states = motion.estimate.states.copy()
    states[3] = np.nan
    at = linearised(motion.prepared, integrator_for(motion.prepared), dataclasses.replace(motion.estimate, states=states))
    assert not at.finite[3] and at.finite.sum() == len(at.finite) - 1
    assert all(np.isfinite(getattr(at, name)).all() for name in ("u", "v", "acceleration", "push", "own", "residual", "jacobian"))
    candidate = (dataclasses.replace(blank(EFFECTS["constant_force"]), constant_force=1e-3),)
    shown = dataclasses.replace(motion.shown(force=0.05), finite=at.finite)
    (found,) = score(motion.prepared, projected(motion, shown), motion.courses, [candidate], motion.mass)
    assert found.gain > 100.0
    assert found.factors[0] * 1e-3 == pytest.approx(0.05, rel=0.05)
