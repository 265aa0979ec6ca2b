"""Periodic orbits by Newton's method, many at once: the steady motion in closed form, long iteration, and the orbits of continuation."""

import numpy as np
import pytest

from tests.batch.rigs import AMPLITUDE, GAP, model, points
from vibrojax.batch import Orbits, Points, Span, Strobes, find_orbits, integrate
from vibrojax.batch.points import lanes_of
from vibrojax.contact import HuntCrossley, Newton
from vibrojax.continuation.orbit import find_orbit
from vibrojax.continuation.rig import ForcedRig
from vibrojax.studies.base import PERIODIC, classify

FREQUENCIES = np.array([4.4, 5.6, 7.7, 8.6])


def scale(at: Points) -> np.ndarray:
    values = at.flat()
    return np.stack([values["base_amplitude"], values["base_amplitude"] * 2.0 * np.pi * values["frequency_hz"]])


def found(rig, at: Points, guess: np.ndarray, period: np.ndarray) -> Orbits:
    lanes, _ = lanes_of(rig, at)
    with Strobes(lanes, chunk=8) as strobes:
        return find_orbits(strobes, np.arange(at.lanes), guess, period, scale(at))


def test_without_a_stop_the_orbit_is_the_steady_motion():
    """u is the imaginary part of A0 Omega^2 / (omega^2 - Omega^2 + 2 i zeta omega Omega); a guess of two cycles has the period of one."""
    at, omega, drive = points(FREQUENCIES, gap=1.0), 2.0 * np.pi * 4.0, 2.0 * np.pi * FREQUENCIES
    steady = AMPLITUDE * drive**2 / (omega**2 - drive**2 + 2j * 0.02 * omega * drive)
    expected = np.stack([steady.imag, drive * steady.real])
    there = found(model(), at, expected + 0.1 * scale(at), np.array([1, 2, 1, 2]))
    assert there.found.all() and there.stable.all() and (there.period == 1).all() and (there.impacts == 0).all()
    assert (there.peak_force == 0).all()
    np.testing.assert_allclose(there.state / scale(at), expected / scale(at), atol=2e-6)


@pytest.mark.parametrize("law", [HuntCrossley(1e6, 1.5, 0.3), Newton(0.7)], ids=["compliant", "rigid"])
def test_an_orbit_is_what_iteration_settles_on(law):
    """From a hundredth of A0 beside it, in a few cycles; p, q, force and speed as in thousands."""
    rig, at = model(law), points(FREQUENCIES)
    ended = integrate(rig, at, span=Span(transient=1200), chunk=8)
    kind = classify(ended, AMPLITUDE, FREQUENCIES)
    chosen = np.flatnonzero(kind.kind == PERIODIC)
    assert chosen.size >= 2
    on = points(FREQUENCIES[chosen])
    state = np.stack([ended.u[chosen, -1], ended.v[chosen, -1]])
    there = found(rig, on, state + 0.01 * scale(on), kind.period[chosen])
    assert there.found.all() and there.stable.all()
    np.testing.assert_array_equal(there.period, kind.period[chosen])
    np.testing.assert_array_equal(there.impacts, kind.impacts[chosen])
    np.testing.assert_allclose(there.state / scale(on), state / scale(on), atol=5e-6)
    np.testing.assert_allclose(there.peak_force, ended.peak_force[chosen].max(axis=1), rtol=1e-5)


def test_stable_and_unstable_orbits_are_those_of_continuation():
    """z = 1/1 loses its stability on the way; another integrator, with exact derivatives, finds the same orbits and the same verdicts."""
    frequencies, rig = np.linspace(5.2, 9.6, 12), model()
    state, orbits = np.array([0.0, 0.0]), []
    ended = integrate(rig, points(frequencies[:1]), span=Span(transient=600), chunk=8)
    state = np.array([ended.u[0, -1], ended.v[0, -1]])
    for frequency in frequencies:
        orbits.append(find_orbit(ForcedRig(rig, gap=GAP, base_amplitude=AMPLITUDE, frequency_hz=frequency), state))
        state = orbits[-1].state
    at = points(frequencies)
    guess = np.stack([one.state for one in orbits], axis=1)
    there = found(rig, at, guess + 1e-3 * scale(at), np.ones(12, int))
    stable = [one.stable for one in orbits]
    assert there.found.all() and any(stable) and not all(stable)
    np.testing.assert_array_equal(there.stable, stable)
    np.testing.assert_array_equal(there.impacts, [one.touches for one in orbits])
    np.testing.assert_allclose(there.state / scale(at), guess / scale(at), atol=2e-4)


def test_a_guess_that_leads_nowhere_is_not_found():
    there = found(model(), points([3.1]), np.array([[-1.0], [30.0]]), np.array([1]))
    assert not there.found.any()
