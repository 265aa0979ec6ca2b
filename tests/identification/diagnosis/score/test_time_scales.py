"""Local averages that blur neither contacts nor vibrations, on rigs of any size."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis.score.time_scales import contact_time, resolution
from vibrojax.contact import NoContact


def test_a_rig_of_the_usual_size_has_the_usual_average(motion):
    assert resolution(motion.at) == 1.5e-3


def test_what_rings_fast_has_a_shorter_one(motion):
    omega = 2.0 * np.pi * 4000.0
    fast = np.stack([np.full_like(motion.at.u, -(omega**2)), motion.at.restoring[..., 1]], axis=-1)
    assert resolution(dataclasses.replace(motion.at, restoring=fast)) == pytest.approx(1.0 / (24.0 * 4000.0))


def test_and_what_has_short_contacts(motion):
    """Of every second sample only."""
    inside = np.arange(motion.at.u.shape[1]) < motion.at.lengths[:, None]
    now_and_then = inside & (np.arange(motion.at.u.shape[1]) % 2 == 1)
    interval = motion.at.ts[0, 1] - motion.at.ts[0, 0]
    assert resolution(dataclasses.replace(motion.at, in_contact=now_and_then)) == pytest.approx(interval / 3.0)


def test_a_contact_lasts_as_the_law_says_at_the_largest_speed(motion):
    law = motion.prepared.model.law
    inside = np.arange(motion.at.u.shape[1]) < motion.at.lengths[:, None]
    fastest = float(np.abs(motion.at.v[inside]).max())
    assert contact_time(law, motion.at, motion.mass) == pytest.approx(
        float(law.contact_time(jnp.asarray(motion.mass), jnp.asarray(fastest)))
    )


def test_without_contact_there_is_no_duration(motion):
    assert np.isnan(contact_time(NoContact(), motion.at, motion.mass))
    still = dataclasses.replace(motion.at, push=np.zeros_like(motion.at.push))
    assert np.isnan(contact_time(motion.prepared.model.law, still, motion.mass))
    assert resolution(dataclasses.replace(still, in_contact=np.zeros_like(still.in_contact))) == 1.5e-3
