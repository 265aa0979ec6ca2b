"""What is read off the records and the nominal fit before any candidate is scored."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.score.probe_scales import probe_scales
from vibrojax.effects import ForceLag, GainError, TimeOffset


def test_the_depth_of_impacts_is_that_of_the_records_and_not_of_a_model_that_goes_too_deep(motion):
    true = probe_scales(motion.prepared, motion.at, motion.estimate).deepest
    fitted = motion.at.u - np.array([r.gap for r in motion.prepared.experiment.records])[motion.at.record][:, None]
    assert true == pytest.approx(fitted[motion.at.in_contact].max(), rel=0.1)
    astray = dataclasses.replace(motion.at, u=motion.at.u + np.where(motion.at.in_contact, 1e-3, 0.0))
    assert probe_scales(motion.prepared, astray, motion.estimate).deepest == true
    unseen = dataclasses.replace(motion.prepared, motions=(None,) * len(motion.prepared.motions))
    assert probe_scales(unseen, astray, motion.estimate).deepest == pytest.approx(true + 1e-3, rel=0.1)
    free = dataclasses.replace(motion.at, in_contact=np.zeros_like(motion.at.in_contact))
    assert probe_scales(motion.prepared, free, motion.estimate).deepest == 0.0


def test_delays_are_those_of_the_records_until_the_model_has_such_a_channel_late(motion):
    found = motion.prepared.experiment
    early = [np.roll(record.channels["impact_force"], -12) for record in found.records]
    records = [dataclasses.replace(r, channels=r.channels | {"impact_force": f}) for r, f in zip(found.records, early, strict=True)]
    late = dataclasses.replace(motion.prepared, experiment=dataclasses.replace(found, records=tuple(records)))
    dt = np.diff(records[0].time)[0]
    assert probe_scales(motion.prepared, motion.at, motion.estimate).lags == {}
    assert probe_scales(late, motion.at, motion.estimate).lags == {"impact_force": pytest.approx(-12 * dt, abs=dt)}
    faults = [(ForceLag(1e-3), False), (TimeOffset(-6e-3, "impact_force"), False), (TimeOffset(1e-3, "cart_displacement"), True)]
    for effect, shown in [*faults, (GainError(1.1, "impact_force"), True)]:
        mended = dataclasses.replace(late, model=dataclasses.replace(late.model, effects=(effect,)))
        assert bool(probe_scales(mended, motion.at, motion.estimate).lags) == shown


def test_contacts_are_those_of_the_fit_record_by_record(motion):
    known = probe_scales(motion.prepared, motion.at, motion.estimate)
    for index, (record, contacts) in enumerate(zip(motion.prepared.experiment.records, known.contacts.values(), strict=True)):
        ends = np.array(contacts)
        inside = np.any((record.time[:, None] >= ends[:, 0]) & (record.time[:, None] <= ends[:, 1]), axis=1)
        assert len(ends) > 3 and np.all(np.diff(ends.ravel()) > 0)
        np.testing.assert_array_equal(inside, motion.at.of_record(motion.at.in_contact, index, len(record.time)))
