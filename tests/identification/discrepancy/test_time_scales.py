"""Local averages that blur neither contacts nor vibrations, on rigs of any size."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.time_scales import contact_time, resolution
from vibrojax.contact import NoContact


@pytest.fixture
def rung(motion):
    """The example with another natural frequency and contact stiffness; its windows know nothing of that."""

    def of(f_n: float, stiffer: float = 1.0):
        values = motion.prepared.model.values()
        changed = motion.prepared.model.replace({"f_n": f_n, "k_i": stiffer * float(values["k_i"])})
        return dataclasses.replace(motion.prepared, model=changed)

    return of


def test_a_rig_of_the_usual_size_has_the_usual_average(motion, rung):
    assert resolution(rung(5.0), motion.at, motion.mass) == 1.5e-3


def test_what_rings_fast_has_a_shorter_one(motion, rung):
    assert resolution(rung(4000.0), motion.at, motion.mass) == pytest.approx(1.0 / (24.0 * 4000.0))


def test_and_what_meets_a_hard_stop(motion, rung):
    soft, hard = (contact_time(rung(5.0, stiffer), motion.at, motion.mass) for stiffer in (1.0, 1e6))
    n = float(motion.prepared.model.values()["n"])
    assert hard == pytest.approx(1e6 ** (-1.0 / (n + 1.0)) * soft)
    assert resolution(rung(5.0, 1e6), motion.at, motion.mass) == pytest.approx(hard / 3.0)


def test_without_contact_there_is_no_duration(motion):
    model = dataclasses.replace(motion.prepared.model, law=NoContact())
    assert np.isnan(contact_time(dataclasses.replace(motion.prepared, model=model), motion.at, motion.mass))
    still = dataclasses.replace(motion.at, push=np.zeros_like(motion.at.push))
    assert np.isnan(contact_time(motion.prepared, still, motion.mass))
