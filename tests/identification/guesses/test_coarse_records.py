"""Records as others make them: few samples a period, one long contact and little else, a rigid stop."""

import numpy as np
import pytest
from scipy.signal import lsim

from identification.experiment import Record
from identification.guesses.motion import kinematics
from identification.guesses.parameters import contact_start
from identification.guesses.suspension import suspension_start
from vibrojax.contact import Newton
from vibrojax.model import Model
from vibrojax.suspension import Free


def test_nine_samples_a_period_give_frequency_damping_and_mass():
    mass, zeta, omega = 5e-6, 0.05, 2 * np.pi * 68.0
    time = np.arange(3000) / 610.0
    tones = np.random.default_rng(0).uniform(0.0, 2 * np.pi, 60)
    frequencies = np.linspace(2.0, 180.0, 60)
    fine = np.arange(3000 * 8) / 4880.0
    force = np.sin(2 * np.pi * frequencies * fine[:, None] + tones).sum(axis=1)
    _, u, _ = lsim(([1 / mass], [1.0, 2 * zeta * omega, omega**2]), force, fine)
    channels = {"hammer_displacement": u[::8], "applied_force": force[::8]}
    record = Record(file="a.csv", kind="forced", gap=1e6, time=time, channels=channels, noise={})
    motion = kinematics(record, mass=1e-6, base_acceleration=np.zeros_like(time))
    values, found = suspension_start([record], [motion], mass=None)
    assert values["f_n"] == pytest.approx(68.0, rel=0.03)
    assert values["zeta"] == pytest.approx(0.05, rel=0.3)
    assert found == pytest.approx(mass, rel=0.1)


def long_contact() -> Record:
    """A body that meets a soft spring at u = 0 and is in touch for half of the record; 500 Hz, a little noise."""
    time = np.arange(100) / 500.0
    omega, begins = np.pi / 0.1, 0.05
    u = np.where(time < begins, time - begins, np.where(time < 0.15, np.sin(omega * (time - begins)) / omega, 0.15 - time))
    u = u + 2e-6 * np.random.default_rng(0).standard_normal(100)
    return Record(
        file="a.csv", kind="drop-test", gap=0.0, time=time, channels={"relative_displacement": u}, noise={"relative_displacement": 2e-6}
    )


def test_a_contact_that_fills_half_of_the_record_is_seen():
    record = long_contact()
    motion = kinematics(record, mass=0.15, base_acceleration=np.zeros(100))
    assert motion is not None
    inside = (record.time > 0.06) & (record.time < 0.14)
    assert motion.touching[inside].all()
    assert not motion.touching[(record.time < 0.04) | (record.time > 0.16)].any()


def test_a_rigid_stop_has_no_force_to_read():
    record = long_contact()
    motion = kinematics(record, mass=0.15, base_acceleration=np.zeros(100))
    model = Model(mass=0.15, suspension=Free(), law=Newton(restitution=0.5))
    assert contact_start(model, [record], [motion], ("e",), load_cell=False) is None
