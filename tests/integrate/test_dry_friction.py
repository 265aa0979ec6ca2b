"""Free decay under dry friction alone: half periods of a cosine about -F/k and F/k in turn, each amplitude 2 F/k below the last."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibrojax.contact import HuntCrossley, NoContact
from vibrojax.effects import CoulombFriction
from vibrojax.excitation import Harmonic, Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.suspension import Linear
from vibrojax.system import System

FREQUENCY, FRICTION = 1.3, 0.2
TIMES = np.arange(0.0, 3.0, 4e-3)


def exact(u0: float, v0: float) -> np.ndarray:
    """Displacement of 1 kg on a linear spring at `TIMES`, from a state with v0 > 0: u = c + A cos(omega (t - t0) + phase)."""
    omega, found, t0, direction = 2.0 * np.pi * FREQUENCY, np.empty_like(TIMES), 0.0, 1.0
    centre = -FRICTION / omega**2
    amplitude, phase = np.hypot(u0 - centre, v0 / omega), np.arctan2(-v0 / omega, u0 - centre)
    while t0 <= TIMES[-1]:
        until = t0 + ((0.0 if direction > 0 else np.pi) - phase) / omega
        inside = (t0 <= TIMES) & (until >= TIMES)
        found[inside] = centre + amplitude * np.cos(omega * (TIMES[inside] - t0) + phase)
        amplitude, t0, phase = amplitude - 2.0 * FRICTION / omega**2, until, 0.0 if direction > 0 else -np.pi
        direction, centre = -direction, -centre
    return found


def integrated(state: jax.Array) -> jax.Array:
    """The same by Runge-Kutta steps of a hundredth of a period."""
    system = System(
        mass=1.0,
        suspension=Linear(damping_ratio=0.0, natural_frequency_hz=FREQUENCY),
        law=NoContact(),
        gap=1.0,
        base=at_rest(),
        applied=Unforced(),
        effects=(CoulombFriction(FRICTION),),
    )
    return Landing(flight_step=0.01 / FREQUENCY)(system, jnp.asarray(TIMES), state).u


@pytest.mark.parametrize("amplitude", [0.6, 0.06])
def test_steps_follow_the_reversals(amplitude):
    """With steps that pass over them the error is 2e-4 and 1e-4."""
    found = integrated(jnp.array([amplitude, 0.03]))
    np.testing.assert_allclose(found, exact(amplitude, 0.03), atol=1e-5)


@pytest.mark.parametrize("amplitude", [0.6, 0.06])
def test_the_derivative_jumps_at_the_reversals(amplitude):
    """With steps that pass over them its error is a twelfth and a third of its largest value."""
    state, step = jnp.array([amplitude, 0.03]), 1e-5
    _, slope = jax.jvp(integrated, (state,), (jnp.array([0.0, 1.0]),))
    expected = (exact(amplitude, 0.03 + step) - exact(amplitude, 0.03 - step)) / (2.0 * step)
    np.testing.assert_allclose(slope, expected, atol=2e-3 * np.abs(expected).max())


def test_sticking_needs_no_short_steps():
    """A cart drives the hammer from stick to slip and back; steps are four times as long as Runge-Kutta steps may be to be stable."""
    force, frequency, amplitude = 4.0, 0.5, 0.5
    omega, drive = 2.0 * np.pi * FREQUENCY, 2.0 * np.pi * frequency
    system = System(
        mass=1.0,
        suspension=Linear(damping_ratio=0.0, natural_frequency_hz=FREQUENCY),
        law=NoContact(),
        gap=1.0,
        base=Harmonic(base_amplitude=amplitude, base_phase=0.3, frequency_hz=frequency),
        applied=Unforced(),
        effects=(CoulombFriction(force),),
    )
    found = Landing(flight_step=1.4e-3, most_steps=10_000)(system, jnp.asarray(TIMES), jnp.array([0.01, 0.0]))

    def rates(t, state):
        u, v = state
        return v, amplitude * drive**2 * np.sin(drive * t + 0.3) - omega**2 * u - force * np.tanh(v / 5e-4)

    expected = solve_ivp(rates, (0.0, TIMES[-1]), (0.01, 0.0), method="Radau", t_eval=TIMES, rtol=1e-9, atol=1e-11).y[0]
    stuck = np.abs(np.gradient(expected, TIMES)) < 5e-4
    assert 0.2 < np.mean(stuck) < 0.8
    np.testing.assert_allclose(found.u, expected, atol=2e-3 * np.ptp(expected))
    assert int(found.steps) < 1.5 * TIMES[-1] / 1.4e-3


def test_a_hammer_that_sticks_on_the_stop_stays_there():
    """The stop's spring slides it slowly at first; without an exponential step the error exceeds the motion."""
    stiffness, force = 1e4, 20.0
    system = System(
        mass=1.0,
        suspension=Linear(damping_ratio=0.0, natural_frequency_hz=FREQUENCY),
        law=HuntCrossley(impact_stiffness=stiffness, impact_exponent=1.0, impact_damping=0.0),
        gap=0.0,
        base=at_rest(),
        applied=Unforced(),
        effects=(CoulombFriction(force),),
    )
    steps = Landing(contact_steps=80.0, flight_step=0.01 / FREQUENCY, most_steps=20_000)
    found = steps(system, jnp.asarray(TIMES[:250]), jnp.array([1e-3, 0.0]))
    omega = 2.0 * np.pi * FREQUENCY

    def rates(t, state):
        u, v = state
        return v, -(omega**2) * u - stiffness * max(u, 0.0) - force * np.tanh(v / 5e-4)

    solved = solve_ivp(rates, (0.0, TIMES[249]), (1e-3, 0.0), method="Radau", t_eval=TIMES[:250], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.u, solved.y[0], atol=1e-2 * np.ptp(solved.y[0]))
