"""Ring-downs of records beside those of models that swing from the same states."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.estimation.ring_downs import rest_place, ring_downs
from identification.experiment import Experiment, Record, Suspension
from identification.result.result import RecordFit
from vibrojax.contact import HuntCrossley, NoContact
from vibrojax.effects import CoulombFriction
from vibrojax.model import Load, Model
from vibrojax.suspension import Free, Linear, Pivot

NOISE, MASS, F_N, ZETA = 1e-5, 0.4, 3.0, 0.01
OMEGA, TIME = 2.0 * np.pi * F_N, np.arange(0.0, 5.0, 2e-3)
STOP = HuntCrossley(impact_stiffness=1e6, impact_exponent=1.5, impact_damping=0.3)
LINEAR = Model(mass=MASS, suspension=Linear(damping_ratio=ZETA, natural_frequency_hz=F_N), law=NoContact())


def recorded(
    acceleration,
    start: tuple[float, float] = (5e-3, 0.0),
    *,
    kind: str = "free-decay",
    gap: float = 1.0,
    channel: str = "hammer_displacement",
) -> tuple[Record, RecordFit]:
    """A record that SciPy integrates, beside a perfect prediction of it, to which an unknown zero of the sensor belongs."""

    def rates(t, y):
        return y[1], acceleration(*y) - 1e6 / MASS * max(y[0] - gap, 0.0) ** 1.5 * (1.0 + 0.3 * y[1])

    u, v = solve_ivp(rates, (0.0, TIME[-1]), start, t_eval=TIME, method="DOP853", rtol=1e-9, atol=1e-12, max_step=2e-3).y
    read = {channel: u + 2e-4 + NOISE * np.random.default_rng(0).normal(size=len(TIME))}
    record = Record(file="a.csv", kind=kind, gap=gap, time=TIME, channels=read, noise={channel: NOISE})
    fit = RecordFit(
        file="a.csv",
        kind=kind,
        gap=gap,
        nuisances=(),
        time=TIME,
        measured=read,
        predicted={channel: u + 2e-4, "cart_displacement": np.zeros(len(TIME))},
        noise={channel: NOISE},
        nrmse={},
        chi2_reduced={},
        relative_displacement=u,
        relative_velocity=v,
        in_contact=u > gap,
        window=np.zeros(len(TIME), int),
    )
    return record, fit


def experiment(record: Record, kind: str = "linear") -> Experiment:
    length = 1.0 if kind == "pivot" else None
    return Experiment(
        name="a", folder=Path("."), mass=MASS, suspension=Suspension(kind=kind, length=length), records=(record,), sha256="ab" * 32
    )


def test_a_model_that_is_right_has_the_measured_damping_and_frequency():
    record, fit = recorded(lambda u, v: -(OMEGA**2) * u - 2.0 * ZETA * OMEGA * v)
    found = ring_downs(experiment(record), (fit,), {"nominal": LINEAR})
    (measured,), (model,) = found.measured, found.models["nominal"]
    assert not found.left_out
    np.testing.assert_allclose(model.damping, ZETA, rtol=1e-3)
    np.testing.assert_allclose(model.frequency, F_N, rtol=1e-4)
    off = (np.array(measured.damping) - ZETA) / measured.damping_stderr
    assert np.sqrt(np.mean(off**2)) < 1.6


def test_of_a_pivot_the_frequency_falls_with_amplitude_in_record_and_model():
    record, fit = recorded(
        lambda u, v: -(OMEGA**2) * np.sin(u) - 2.0 * ZETA * OMEGA * v, (1.5, 0.0), gap=100.0, channel="relative_displacement"
    )
    model = Model(mass=MASS, suspension=Pivot(damping_ratio=ZETA, natural_frequency_hz=F_N, length=1.0), law=NoContact())
    found = ring_downs(experiment(record, "pivot"), (fit,), {"nominal": model})
    (measured,), (simulated,) = found.measured, found.models["nominal"]
    assert measured.frequency[0] < 0.95 * measured.frequency[-1]
    np.testing.assert_allclose(measured.frequency, simulated.frequency, rtol=2e-4)
    np.testing.assert_allclose(measured.damping, simulated.damping, rtol=0.01)


def test_flights_between_impacts_show_dry_friction():
    """A viscous model is level, one with friction follows the measured damping, which rises as the flights become small."""
    friction = 0.02 * OMEGA**2 * 5e-3
    record, fit = recorded(
        lambda u, v: -(OMEGA**2) * u - 2.0 * ZETA * OMEGA * v - friction * np.tanh(v / 1e-4), (-6e-3, 0.0), kind="drop-test", gap=0.0
    )
    nominal = dataclasses.replace(LINEAR, law=STOP)
    rubbing = dataclasses.replace(nominal, effects=(CoulombFriction(friction_force=MASS * friction),))
    found = ring_downs(experiment(record), (fit,), {"nominal": nominal, "coulomb_friction": rubbing})
    (measured,), (level,), (rising,) = found.measured, found.models["nominal"], found.models["coulomb_friction"]
    assert len(measured.amplitude) > 5
    np.testing.assert_allclose(level.damping, ZETA, rtol=0.02)
    assert max(measured.damping) > 1.5 * min(measured.damping)
    there = np.interp(measured.amplitude, rising.amplitude[::-1], rising.damping[::-1])
    off = (np.array(measured.damping) - there) / measured.damping_stderr
    assert np.sqrt(np.mean(off**2)) < 1.6


def test_under_a_known_load_flights_swing_about_the_place_where_that_is_borne():
    """A pull away from the stop holds the hammer 2 mm off: let go 4 mm behind that, it loses what viscous damping takes."""
    record, fit = recorded(lambda u, v: -(OMEGA**2) * (u + 2e-3) - 2.0 * ZETA * OMEGA * v, (-6e-3, 0.0), kind="drop-test", gap=0.0)
    model = dataclasses.replace(LINEAR, law=STOP, load=Load(constant_force=-MASS * OMEGA**2 * 2e-3))
    assert rest_place(model, record) == pytest.approx(-2e-3, rel=1e-6)
    found = ring_downs(experiment(record), (fit,), {"nominal": model})
    assert len(found.measured) == len(found.models["nominal"]) == 2  # flights between impacts, and the vibration after the last of them
    for measured, simulated in zip(found.measured, found.models["nominal"], strict=True):
        np.testing.assert_allclose(simulated.damping, ZETA, rtol=0.02)
        assert max(measured.amplitude) < 4.1e-3
        off = (np.array(measured.damping) - ZETA) / measured.damping_stderr
        assert np.sqrt(np.mean(off**2)) < 1.6


@pytest.mark.parametrize(
    ("change", "kind", "why"),
    [
        ({"kind": "cart-excitation"}, "linear", "driven throughout"),
        ({"kind": "forced"}, "linear", "driven throughout"),
        ({"measured": {}}, "linear", "its displacement was not recorded"),
        ({}, "free", "without a spring nothing vibrates"),
        ({"in_contact": np.arange(len(TIME)) % 12 == 0}, "linear", "no swing out and back"),
    ],
)
def test_a_record_without_a_decay_is_left_out_and_says_why(change, kind, why):
    record, fit = recorded(lambda u, v: -(OMEGA**2) * u)
    model = LINEAR if kind == "linear" else dataclasses.replace(LINEAR, suspension=Free())
    found = ring_downs(experiment(record, kind), (dataclasses.replace(fit, **change),), {"nominal": model})
    assert found.measured == ()
    assert found.models == {"nominal": ()}
    assert why in found.left_out["a.csv"]
