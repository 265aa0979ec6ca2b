import numpy as np
import pytest

from benchmarks import oracle
from tests.batch.rigs import AMPLITUDE, FREQUENCIES, model, oracle_motion, points
from vibrojax.batch import ExactFlight, Sampled, Span, Stepping, grid, integrate
from vibrojax.contact import HuntCrossley, KelvinVoigt, LankaraniNikravesh, Newton
from vibrojax.integrate import Switch

SIX = Span(transient=0, recorded=6, closed=None)


def largest_miss(found, motions) -> float:
    return max(np.abs(found.u[i] - motion.u[1:]).max() for i, motion in enumerate(motions)) / AMPLITUDE


@pytest.fixture(scope="module")
def exact():
    return [oracle_motion(f, 6) for f in FREQUENCIES]


@pytest.mark.parametrize(
    ("engine", "tolerance"),
    [(ExactFlight(), 5e-6), (ExactFlight(contact_steps=64.0), 1e-8), (Stepping(), 1e-4), (Sampled(), 5e-9), (Sampled(Switch()), 5e-9)],
    ids=["fast", "fast, fine", "stepping", "diffrax", "switch"],
)
def test_section_points_agree_with_the_oracle(engine, tolerance, exact):
    found = integrate(model(), points(), span=SIX, engine=engine, chunk=8)
    assert found.failures == {}
    assert largest_miss(found, exact) < tolerance
    assert found.impacts.sum(axis=-1).tolist() == [len(motion.impacts) for motion in exact]


def test_the_error_falls_with_the_fifth_power_of_the_contact_steps(exact):
    misses = [largest_miss(integrate(model(), points(), span=SIX, engine=ExactFlight(n), chunk=8), exact) for n in (16.0, 32.0)]
    assert 4.0 < np.log2(misses[0] / misses[1]) < 7.0


def test_peaks_and_speeds_agree_with_a_fine_reference(exact):
    fast = integrate(model(), points(), span=SIX, chunk=8)
    fine = integrate(model(), points(), span=SIX, engine=Sampled(Switch(), samples=4000), chunk=8)
    np.testing.assert_allclose(fast.peak_force.max(-1), fine.peak_force.max(-1), rtol=3e-4)
    np.testing.assert_allclose(fast.u_max, fine.u_max, rtol=1e-4)
    np.testing.assert_allclose(fast.impact_speed.max(-1), [max(i.v_minus for i in m.impacts) for m in exact], rtol=1e-4)


@pytest.mark.parametrize(
    ("law", "force", "rig", "tolerance"),
    [
        (HuntCrossley(2.1e8, 1.6, 0.6), oracle.hunt_crossley(2.1e8, 1.6, 0.6), dict(mass=2.0), 2e-6),
        (KelvinVoigt(2e5, 3e-4), oracle.kelvin_voigt(2e5, 60.0), {}, 2e-6),
        (
            LankaraniNikravesh(1e6, 1.5, 0.8),
            lambda delta, rate, v0: oracle.hunt_crossley(1e6, 1.5, 0.27 / v0)(delta, rate, v0),
            {},
            2e-6,
        ),
        (Newton(0.8), False, dict(restitution=0.8), 1e-8),
    ],
    ids=["stiff", "kelvin-voigt", "lankarani-nikravesh", "newton"],
)
def test_the_fast_path_takes_any_law(law, force, rig, tolerance):
    exact = [oracle_motion(f, 6, force=force, **rig) for f in FREQUENCIES[:4]]
    parts = {"mass": rig["mass"]} if "mass" in rig else {}
    found = integrate(model(law, **parts), points(FREQUENCIES[:4]), span=SIX, engine=ExactFlight(), chunk=8)
    assert found.failures == {}
    assert largest_miss(found, exact) < tolerance


def test_a_strobe_inside_a_contact_is_hit():
    """The phase of the base moves the strobe through the whole cycle, contacts included."""
    phases = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    axes = grid({"base_phase": phases}, frequency_hz=5.2, base_amplitude=AMPLITUDE, gap=0.0, u0=-1e-3)
    fast = integrate(model(), axes, span=SIX, engine=ExactFlight(contact_steps=32.0), chunk=8)
    stepped = integrate(model(), axes, span=SIX, engine=Stepping(contact_steps=240.0, flight_steps=1000.0), chunk=32)
    assert np.asarray(fast.state.in_contact).sum() >= 2
    np.testing.assert_array_equal(fast.state.in_contact, stepped.state.in_contact)
    np.testing.assert_allclose(fast.u, stepped.u, atol=2e-5 * AMPLITUDE)
    np.testing.assert_allclose(fast.peak_force, stepped.peak_force, rtol=5e-4, atol=1e-3)
    np.testing.assert_array_equal(fast.impacts, stepped.impacts)


def test_a_hammer_pressed_on_the_stop_stays_there():
    """A stop behind the rest position (gap below zero) and a weak drive: one contact without end."""
    found = integrate(
        model(), grid({"frequency_hz": [3.0, 5.0]}, base_amplitude=1e-5, gap=-1e-3, u0=-9e-4), span=Span(transient=300, recorded=6), chunk=8
    )
    assert found.failures == {}
    assert np.asarray(found.state.in_contact).all()
    assert (found.impacts == 0).all()
    assert (found.peak_force > 0).all()


def test_without_an_impact_the_motion_is_the_steady_one():
    found = integrate(model(), points(gap=1.0), span=Span(transient=400, recorded=6), chunk=8)
    omega, omega_n = 2 * np.pi * FREQUENCIES, 2 * np.pi * 4.0
    steady = AMPLITUDE * omega**2 / np.abs(omega_n**2 - omega**2 + 2j * 0.02 * omega_n * omega)
    np.testing.assert_allclose(found.u_max, steady, rtol=3e-5)
    assert found.closed.tolist() == [1] * 6
    assert (found.impacts == 0).all()
