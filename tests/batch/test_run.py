import dataclasses

import numpy as np
import pytest

from tests.batch.rigs import AMPLITUDE, model, points
from vibrojax.batch import ExactFlight, Sampled, Span, Stepping, grid, integrate
from vibrojax.contact import Newton, NoContact
from vibrojax.effects import CubicStiffness, GainError, GapStep, SecondMode
from vibrojax.errors import InputError
from vibrojax.suspension import Pendulum


def test_chunks_and_threads_do_not_change_the_answer():
    axes, span = points(np.linspace(3.0, 9.0, 11)), Span(transient=12, recorded=6, closed=None)
    one = integrate(model(), axes, span=span, chunk=8, threads=1)
    two = integrate(model(), axes, span=span, chunk=4, threads=2)
    np.testing.assert_allclose(one.u, two.u, atol=1e-9 * AMPLITUDE)
    np.testing.assert_array_equal(one.impacts, two.impacts)


def test_an_orbit_that_has_closed_goes_on_as_if_integrated():
    axes = points(np.linspace(3.0, 9.0, 24))
    stopped = integrate(model(), axes, span=Span(transient=500, recorded=12), chunk=8)
    through = integrate(model(), axes, span=Span(transient=500, recorded=12, closed=None), chunk=8)
    early = stopped.closed > 0
    assert early.sum() > 12 and set(stopped.closed[early]) > {1}
    assert (stopped.cycles[early] < through.cycles[early]).mean() > 0.9
    np.testing.assert_allclose(stopped.u[early], through.u[early], atol=1e-6 * AMPLITUDE)
    np.testing.assert_array_equal(stopped.impacts[early], through.impacts[early])
    np.testing.assert_allclose(stopped.peak_force[early], through.peak_force[early], rtol=1e-5)


def test_a_batch_goes_on_from_where_another_ended():
    axes = points()
    whole = integrate(model(), axes, span=Span(transient=6, recorded=6, closed=None), chunk=8)
    first = integrate(model(), axes, span=Span(transient=0, recorded=6, closed=None), chunk=8)
    second = integrate(model(), axes, span=Span(transient=0, recorded=6, closed=None), chunk=8, start=first.state)
    np.testing.assert_allclose(second.u, whole.u, atol=1e-12)


def test_any_parameter_is_an_axis():
    found = integrate(
        model(),
        grid({"zeta": [0.01, 0.1], "m": [0.4, 0.5, 0.6]}, frequency_hz=5.0, base_amplitude=AMPLITUDE, gap=0.0),
        span=Span(recorded=6),
        chunk=8,
    )
    assert found.u.shape == (2, 3, 6)
    assert list(found.coords) == ["zeta", "m"]
    assert found.peak_force[0, 0].max() != found.peak_force[1, 2].max()


@pytest.mark.parametrize(
    "parts",
    [
        dict(effects=(CubicStiffness(3e5),)),
        dict(suspension=Pendulum(0.02, 4.0, length=0.05)),
        dict(effects=(SecondMode(mode_mass=0.02, mode_frequency_hz=60.0, mode_damping_ratio=0.05),)),
    ],
    ids=["cubic", "pendulum", "second mode"],
)
def test_models_beyond_the_fast_path_are_stepped(parts):
    rig, axes, span = model(**parts), points(np.array([3.1, 5.2])), Span(transient=0, recorded=4, closed=None)
    found = integrate(rig, axes, span=span, chunk=2)
    assert found.engine == "stepping" and found.failures == {}
    fine = integrate(rig, axes, span=span, chunk=2, engine=Stepping(contact_steps=180.0, flight_steps=800.0))
    np.testing.assert_allclose(found.u, fine.u, atol=1e-4 * AMPLITUDE)
    np.testing.assert_array_equal(found.impacts, fine.impacts)
    linear = integrate(model(), axes, span=span, chunk=8)
    assert np.abs(found.u - linear.u).max() > 1e-3 * AMPLITUDE


def test_a_pendulum_agrees_with_the_switch_model():
    rig, axes, span = (
        model(suspension=Pendulum(0.02, 4.0, length=0.05)),
        points(np.array([4.4])),
        Span(transient=0, recorded=4, closed=None),
    )
    stepped = integrate(rig, axes, span=span, chunk=1)
    reference = integrate(rig, axes, span=span, chunk=1, engine=Sampled())
    np.testing.assert_allclose(stepped.u, reference.u, atol=5e-5 * AMPLITUDE)


def test_chatter_on_a_rigid_stop_is_reported():
    found = integrate(model(Newton(0.3)), points(np.array([3.0]), gap=-5e-4, u0=-1e-3), span=Span(transient=0, recorded=6), chunk=8)
    assert list(found.failures) == ["impacts on the rigid stop accumulate (chatter)"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(stiffness=1.0), "unknown setting 'stiffness': expected one of frequency_hz"),
        (dict(base_amplitude=-1.0), "base_amplitude is -1 somewhere"),
        (dict(gap=np.nan), "gap holds numbers that are not finite"),
        (dict(m=0.0), "m is 0 somewhere: expected numbers above 0"),
    ],
)
def test_bad_points_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        integrate(model(), points(**change))


def test_what_is_missing_or_out_of_place_is_named():
    with pytest.raises(InputError, match="gap is given neither as an axis nor as a fixed value"):
        integrate(model(), grid({"frequency_hz": [3.0]}, base_amplitude=1e-3))
    with pytest.raises(InputError, match="axis gap has shape"):
        grid({"gap": []})
    with pytest.raises(InputError, match="u0 lies behind a rigid stop"):
        integrate(model(Newton(0.8)), points(u0=2e-3))
    with pytest.raises(InputError, match=r"the engine exact-flight does not integrate effects \(cubic_stiffness\)"):
        integrate(model(effects=(CubicStiffness(1.0),)), points(), engine=ExactFlight())
    with pytest.raises(InputError, match="expected at least 0 and at least 1"):
        integrate(model(), points(), span=Span(recorded=0))
    with pytest.raises(InputError, match="chunk is 0"):
        integrate(model(), points(), chunk=0)


@pytest.mark.parametrize("start", [{"gap": 1e-3, "u0": 1.2e-3}, {"gap": -2e-3}], ids=["thrown in", "pressed on"])
def test_a_start_inside_the_stop_keeps_its_indentation(start):
    axes = grid({"frequency_hz": [5.0, 6.0]}, base_amplitude=AMPLITUDE, **start)
    fast, slow = (integrate(model(), axes, span=Span(transient=0, recorded=2, closed=None), engine=e) for e in (ExactFlight(), Stepping()))
    np.testing.assert_allclose(fast.peak_force[:, 0], slow.peak_force[:, 0], rtol=2e-3)
    np.testing.assert_allclose(fast.u[:, 0], slow.u[:, 0], atol=1e-3 * AMPLITUDE)


@pytest.mark.parametrize("engine", [ExactFlight(), Stepping()])
def test_without_a_stop_nothing_is_touched(engine):
    axes = grid({"frequency_hz": [5.0]}, base_amplitude=AMPLITUDE, gap=1e-4)
    found = integrate(dataclasses.replace(model(), law=NoContact()), axes, span=Span(transient=300, recorded=4), engine=engine)
    assert found.failures == {}
    assert not found.impacts.any()
    steady = AMPLITUDE * 25.0 / abs(16.0 - 25.0 + 2j * model().suspension.damping_ratio * 20.0)
    assert found.u_max[0] == pytest.approx(steady, rel=1e-4)


@pytest.mark.parametrize("engine", [ExactFlight(), Stepping()])
@pytest.mark.parametrize("closed", [1e-9, None])
def test_the_largest_displacement_is_that_of_the_recorded_cycles(engine, closed):
    """A heavily damped rig closes soon, and overshoots before."""
    rig = model().replace({"zeta": 0.5})
    axes = grid({"frequency_hz": [6.0]}, base_amplitude=AMPLITUDE, gap=1.0)
    found = integrate(rig, axes, span=Span(transient=60, recorded=16, closed=closed), engine=engine)
    steady = AMPLITUDE * 36.0 / abs(16.0 - 36.0 + 2j * 0.5 * 24.0)
    assert found.u_max[0] == pytest.approx(steady, rel=1e-5)


def test_an_axis_is_not_also_a_fixed_value():
    with pytest.raises(InputError, match="gap is given both as an axis and as a fixed value"):
        grid({"gap": [0.0, 1e-3]}, frequency_hz=5.0, base_amplitude=AMPLITUDE, gap=1e-3)


def test_what_belongs_to_a_recorder_or_to_one_record_is_not_the_rigs():
    strange = (GainError(factor=2.0, of_channel="impact_force"), GapStep(gap_jump=5e-4, instant=0.1, in_file="cart2.csv"))
    axes, span = points(), Span(transient=6, recorded=6, closed=None)
    bare = integrate(model(), axes, span=span, chunk=8)
    found = integrate(dataclasses.replace(model(), effects=strange), axes, span=span, chunk=8)
    assert found.engine == bare.engine == "exact-flight"
    np.testing.assert_array_equal(found.u, bare.u)


@pytest.mark.parametrize(
    ("axis", "rig", "message"),
    [
        ({"k_i": [-1e6, 1e6]}, model(), "k_i is -1e\\+06 somewhere: expected a number of at least 0"),
        ({"n": [0.0, 1.5]}, model(), "n is 0 somewhere: expected a number above 0"),
        ({"e": [0.5, 1.5]}, dataclasses.replace(model(), law=Newton(0.8)), "e is 1.5 somewhere: expected a number of at most 1"),
    ],
)
def test_parameters_that_are_not_possible_are_refused(axis, rig, message):
    with pytest.raises(InputError, match=message):
        integrate(rig, grid(axis, frequency_hz=5.0, base_amplitude=AMPLITUDE, gap=1e-3))


def test_samples_do_not_show_the_touches_of_a_rigid_stop():
    with pytest.raises(InputError, match="the engine sampled does not integrate a rigid stop, whose touches lie between samples"):
        integrate(dataclasses.replace(model(), law=Newton(0.8)), points(), engine=Sampled())
