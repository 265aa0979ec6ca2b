"""What is read off the records and the nominal fit before any candidate is tried."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.facts import facts


def test_the_depth_of_impacts_is_that_of_the_records_and_not_of_a_model_that_goes_too_deep(motion):
    true = facts(motion.prepared, motion.at, motion.estimate).deepest
    fitted = motion.at.u - np.array([r.gap for r in motion.prepared.experiment.records])[motion.at.record][:, None]
    assert true == pytest.approx(fitted[motion.at.in_contact].max(), rel=0.1)
    astray = dataclasses.replace(motion.at, u=motion.at.u + np.where(motion.at.in_contact, 1e-3, 0.0))
    assert facts(motion.prepared, astray, motion.estimate).deepest == true
    unseen = dataclasses.replace(motion.prepared, motions=(None,) * len(motion.prepared.motions))
    assert facts(unseen, astray, motion.estimate).deepest == pytest.approx(true + 1e-3, rel=0.1)
    free = dataclasses.replace(motion.at, in_contact=np.zeros_like(motion.at.in_contact))
    assert facts(motion.prepared, free, motion.estimate).deepest == 0.0
