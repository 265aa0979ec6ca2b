import numpy as np
import pytest

from tests.batch.rigs import AMPLITUDE, model, points
from vibrojax.batch import ExactFlight, Sampled, Span, Stepping, grid, integrate
from vibrojax.contact import Newton
from vibrojax.effects import CubicStiffness, SecondMode
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
