"""First guesses against closed forms."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from identification.experiment import Experiment, Record, Suspension
from identification.guesses import parameters
from identification.guesses.motion import Kinematics, harmonic_start, kinematics
from identification.guesses.parameters import Loops, contact_start, first_guesses
from identification.guesses.suspension import suspension_start
from vibrojax.contact import HuntCrossley
from vibrojax.effects.stops import DeepStop
from vibrojax.model import Model
from vibrojax.suspension import Linear

TIME = np.arange(8000) / 4000.0


def test_harmonic_start_reads_amplitude_and_phase():
    """Linear least squares on the cart's displacement, with an offset in the way."""
    y = 0.002 * np.sin(2 * np.pi * 7.0 * TIME + 0.7) + 0.01
    record = Record(
        file="a.csv", kind="cart-excitation", gap=0.0, time=TIME, excitation_frequency=7.0, channels={"cart_displacement": y}, noise={}
    )
    assert harmonic_start(record) == pytest.approx((0.002, 0.7), rel=1e-9)


@pytest.mark.parametrize("zeta", [0.005, 0.05, 0.3])
def test_suspension_start_reads_a_free_decay(zeta):
    """Weak form on u = exp(-zeta w t) cos(w_d t), with sensor noise: frequency to 0.01 %, damping to 5 %."""
    omega = 2 * np.pi * 5.0
    u = 0.01 * np.exp(-zeta * omega * TIME) * np.cos(omega * np.sqrt(1 - zeta**2) * TIME)
    u += 1e-6 * np.random.default_rng(1).standard_normal(len(TIME))
    record = Record(file="a.csv", kind="free-decay", gap=1.0, time=TIME, channels={"hammer_displacement": u}, noise={})
    motion = kinematics(record, mass=1.0, base_acceleration=np.zeros_like(TIME))
    values, mass = suspension_start([record], [motion], mass=1.0)
    assert values["f_n"] == pytest.approx(5.0, rel=1e-4)
    assert values["zeta"] == pytest.approx(zeta, rel=0.05)
    assert mass == 1.0


@pytest.mark.parametrize("missing", [0, 3])
def test_suspension_start_reads_the_mass_of_a_forced_oscillator(missing):
    """With an applied force the mass is a third unknown of the same regression; a few samples of it may be missing."""
    mass, omega, zeta, drive = 2.5, 2 * np.pi * 5.0, 0.05, 2 * np.pi * 4.0
    gain = 1.0 / (mass * (omega**2 - drive**2 + 2j * zeta * omega * drive))
    force = 3.0 * np.sin(drive * TIME)
    u = np.imag(3.0 * gain * np.exp(1j * drive * TIME))
    force[4000 : 4000 + missing] = np.nan
    u += np.imag(1e-4 * np.exp((-zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)) * TIME))
    record = Record(file="a.csv", kind="forced", gap=1.0, time=TIME, channels={"hammer_displacement": u, "applied_force": force}, noise={})
    motion = kinematics(record, mass=1.0, base_acceleration=np.zeros_like(TIME))
    values, found = suspension_start([record], [motion], mass=None)
    assert found == pytest.approx(mass, rel=2e-2)
    assert values["f_n"] == pytest.approx(5.0, rel=1e-2)


def loops_of_a_known_law() -> tuple[Record, Kinematics, Model]:
    """Three impacts, 2e6 delta^1.5 (1 + 0.4 delta'), gap off by 20 um."""
    phase = np.pi * np.arange(-40, 81) / 40
    shape = np.where(phase < 0, phase, np.where(phase > np.pi, np.pi - phase, np.sin(phase)))
    delta = np.concatenate([peak * shape for peak in (2e-4, 3e-4, 5e-4)])
    time = np.arange(len(delta)) * 1.25e-4
    rate = np.gradient(delta, time)
    force = np.where(delta > 0, 2e6 * np.maximum(delta, 0) ** 1.5 * (1 + 0.4 * rate), 0.0)
    record = Record(
        file="a.csv",
        kind="drop-test",
        gap=0.0,
        time=time,
        channels={"hammer_displacement": delta + 2e-5, "impact_force": force},
        noise={"impact_force": 0.05},
    )
    motion = kinematics(record, mass=1.0, base_acceleration=np.zeros_like(time))
    assert motion is not None
    return record, motion, Model(mass=1.0, suspension=Linear(0.01, 3.0), law=HuntCrossley(1e6, 1.5, 0.3))


def test_contact_start_reads_the_force_law():
    """To a few per cent."""
    record, motion, model = loops_of_a_known_law()
    found = contact_start(model, [record], [motion], ("k_i", "n", "lambda_i"), load_cell=True)
    assert found is not None
    values, errors, misfit, load_cell = found
    assert load_cell
    assert misfit < 0.1 * contact_start(model, [record], [motion], ("lambda_i",), load_cell=True).misfit
    assert values["n"] == pytest.approx(1.5, abs=0.1)
    assert values["lambda_i"] == pytest.approx(0.4, rel=0.15)
    assert values["k_i"] * 3e-4 ** values["n"] == pytest.approx(2e6 * 3e-4**1.5, rel=0.1)
    assert errors[0] == pytest.approx(2e-5, abs=1e-5)


def test_loops_show_a_harder_stop_behind_the_first():
    record, motion, model = loops_of_a_known_law()
    deep = 4e7 * np.maximum(motion.u - 2e-5 - 3e-4, 0.0) ** 1.5
    harder = dataclasses.replace(motion, force=motion.force + deep)
    stops = lambda deepest, force: [DeepStop(force / (0.3 * deepest) ** 1.5, part * deepest, 0.3) for part in (0.5, 0.8)]  # noqa: E731
    names = ("k_i", "lambda_i", "deep_stop.deep_stiffness", "deep_stop.depth", "deep_stop.deep_damping")
    found = contact_start(model, [record], [harder], names, load_cell=True, effects=stops)
    assert found is not None
    assert found[0]["k_i"] == pytest.approx(2e6, rel=0.3)
    assert found[0]["deep_stop.depth"] == pytest.approx(3e-4, rel=0.1)
    assert found[0]["deep_stop.deep_stiffness"] == pytest.approx(4e7, rel=0.3)
    assert contact_start(model, [record], [harder], names, load_cell=True, effects=lambda deepest, force: []) is None


@pytest.mark.parametrize(("cell_gap", "stiffness"), [(3e-3, 2e6), (7e-5, 1e6)])
def test_contact_is_read_off_the_inertia_only_where_the_cell_shows_the_stop_millimetres_away(monkeypatch, cell_gap, stiffness):
    """A gap that was set wrong by 70 um does not speak against the cell."""
    record, motion, model = loops_of_a_known_law()
    read = {True: Loops({"k_i": 1e6}, np.array([cell_gap]), 1.0, True), False: Loops({"k_i": 2e6}, np.array([1e-5]), 1.0, False)}
    monkeypatch.setattr(parameters, "contact_start", lambda *_, load_cell, effects: read[load_cell])
    experiment = Experiment(
        name="cell", folder=Path(), mass=1.0, suspension=Suspension(kind="linear"), law="hunt-crossley", sha256="", records=(record,)
    )
    values, _ = first_guesses(experiment, model, [motion])
    assert values["k_i"] == stiffness


def test_a_force_that_is_not_finite_gives_no_start():
    record, motion, model = loops_of_a_known_law()
    infinite = dataclasses.replace(motion, force=np.where(motion.touching, np.inf, motion.force))
    assert contact_start(model, [record], [infinite], ("k_i", "n", "lambda_i"), load_cell=True) is None


def test_contact_start_is_empty_without_a_load_cell():
    """Asked to read a load cell that is not there, it finds nothing rather than something; the hammer's inertia gives the force."""
    record, motion, model = loops_of_a_known_law()
    deaf = dataclasses.replace(motion, force=None)
    assert contact_start(model, [record], [motion], ("k_i",), load_cell=True) is not None
    assert contact_start(model, [record], [deaf], ("k_i",), load_cell=True) is None
    assert contact_start(model, [record], [deaf], ("k_i",), load_cell=False) is not None
