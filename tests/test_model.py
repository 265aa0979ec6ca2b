import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibrojax import Linear, Model, read_model, simulate, write_model
from vibrojax.batch import grid, integrate
from vibrojax.contact import HuntCrossley, NoContact
from vibrojax.errors import InputError
from vibrojax.integrate import Landing, Smoothed
from vibrojax.model import STANDARD_GRAVITY, Load
from vibrojax.model_file import model_document
from vibrojax.suspension import Free, Pendulum, Pivot

MASS = 0.4
SLOPE = Load(incline=float(np.radians(5.0)), constant_force=-0.1)
FORCE = MASS * STANDARD_GRAVITY * np.sin(np.radians(5.0)) - 0.1
TS = jnp.linspace(0.0, 0.5, 501)


def displacement(suspension, *, integrator=None, law=None, load=SLOPE, gap=1e3, ts=TS):
    model = Model(mass=MASS, suspension=suspension, law=law or NoContact(), load=load)
    return np.asarray(simulate(model, ts, gap=gap, y0=jnp.array([-0.02, 0.1]), integrator=integrator)["hammer_displacement"])


@pytest.mark.parametrize("integrator", [Landing(), Smoothed(smoothing=1e-8)])
def test_a_free_hammer_on_an_incline_follows_a_parabola(integrator):
    law = None if isinstance(integrator, Landing) else HuntCrossley(1e6, 1.5, 0.3)
    parabola = -0.02 + 0.1 * TS + 0.5 * FORCE / MASS * TS**2
    np.testing.assert_allclose(displacement(Free(), integrator=integrator, law=law), parabola, rtol=0, atol=1e-9)


def linear(u, v, drive, omega, zeta=0.02):
    return drive - 2 * zeta * omega * v - omega**2 * u


def pendulum(u, v, drive, omega, zeta=0.02, length=0.2):
    s = u / length
    c2 = 1 - s**2
    return c2 * drive - 2 * zeta * omega * v - omega**2 * np.sqrt(c2) * u - s * v**2 / (length * c2)


def pivot(u, v, drive, omega, zeta=0.02, length=0.2):
    return drive - 2 * zeta * omega * v - omega**2 * length * np.sin(u / length)


@pytest.mark.parametrize(
    ("suspension", "acceleration"),
    [(Linear(0.02, 3.0), linear), (Pendulum(0.02, 1.1, 0.2), pendulum), (Pivot(0.02, 1.1, 0.2), pivot)],
    ids=["linear", "pendulum", "pivot"],
)
def test_every_suspension_feels_it_as_an_independent_integration_does(suspension, acceleration):
    omega = 2 * np.pi * suspension.natural_frequency_hz
    expected = solve_ivp(
        lambda t, y: [y[1], acceleration(y[0], y[1], FORCE / MASS, omega)],
        (0.0, 0.5),
        [-0.02, 0.1],
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
        t_eval=np.asarray(TS),
    )
    np.testing.assert_allclose(displacement(suspension), expected.y[0], rtol=0, atol=1e-7)
    assert np.abs(displacement(suspension) - displacement(suspension, load=Load())).max() > 1e-3


def test_a_hammer_that_bounces_down_an_incline_as_an_independent_integration_has_it():
    law, gap, pull = HuntCrossley(1e5, 1.5, 0.2), 0.0, FORCE / MASS

    def rates(t, y):
        depth = max(y[0] - gap, 0.0)
        return [y[1], pull - max(1e5 * depth**1.5 * (1.0 + 0.2 * y[1]), 0.0) / MASS]

    ts = jnp.linspace(0.0, 0.3, 301)
    expected = solve_ivp(rates, (0.0, 0.3), [-0.02, 0.1], method="DOP853", rtol=1e-10, atol=1e-13, max_step=2e-5, t_eval=np.asarray(ts))
    assert expected.y[0].max() > 1e-4
    np.testing.assert_allclose(displacement(Free(), law=law, gap=gap, ts=ts), expected.y[0], rtol=0, atol=2e-7)


def test_many_operating_points_feel_the_load():
    model = Model(mass=MASS, suspension=Linear(0.5, 3.0), law=NoContact(), load=SLOPE)
    found = integrate(model, grid({"frequency_hz": [1.0, 2.0]}, base_amplitude=0.0, gap=1.0))
    rest = FORCE / (MASS * (2 * np.pi * 3.0) ** 2)
    np.testing.assert_allclose(np.asarray(found.u_max), rest, rtol=1e-6)


def test_gravity_grows_with_the_mass_and_the_force_does_not():
    assert SLOPE.force(2.0 * MASS) - SLOPE.force(MASS) == pytest.approx(MASS * STANDARD_GRAVITY * np.sin(np.radians(5.0)))


def test_a_gauge_behind_suspension_and_stop_reads_the_load():
    model = Model(mass=MASS, suspension=Linear(0.02, 3.0), law=NoContact(), load=SLOPE)
    rest = FORCE / (MASS * (2 * np.pi * 3.0) ** 2)
    readings = simulate(model, TS, gap=1e3, y0=jnp.array([rest, 0.0]))
    np.testing.assert_allclose(readings["reaction_force"], FORCE, rtol=1e-9)


def test_the_model_file_keeps_it(tmp_path):
    model = Model(mass=MASS, suspension=Free(), law=NoContact(), load=SLOPE)
    write_model(model, tmp_path / "model.json")
    found = read_model(tmp_path / "model.json")
    assert found.load == SLOPE
    assert found.replace({"m": 1.0}).load == SLOPE
    assert "load" not in model_document(Model(mass=MASS, suspension=Free(), law=NoContact()))


def test_a_model_file_with_another_key_under_load(tmp_path):
    write_model(Model(mass=MASS, suspension=Free(), law=NoContact(), load=SLOPE), tmp_path / "model.json")
    text = (tmp_path / "model.json").read_text().replace('"incline": 0', '"inclin": 0', 1)
    (tmp_path / "model.json").write_text(text)
    with pytest.raises(InputError, match="load: unknown key 'inclin': did you mean 'incline'"):
        read_model(tmp_path / "model.json")
