"""Columns beside a chain."""

import numpy as np

from identification.trajectory.additions import reestimated
from identification.trajectory.fit import fit


def test_columns_that_the_records_cannot_tell_apart_share_what_one_would_explain(vibrating):
    """Neither grows beside the other, and nothing is gained by the second."""
    found = fit(vibrating, both=False)
    chains = found.problem.chains
    wave = np.sin(0.3 * np.arange(chains.weight[..., 0].size)).reshape(chains.weight.shape)[..., None]
    end = np.zeros((len(chains.left), 2, 1))
    one = reestimated(found, wave, end, found.variances)
    two = reestimated(found, np.concatenate([wave, wave], axis=-1), np.concatenate([end, end], axis=-1), found.variances)
    assert abs(one.deviance - two.deviance) < 0.1
    assert np.allclose(two.strengths, 0.5 * one.strengths, rtol=1e-3)
