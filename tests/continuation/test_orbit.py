"""Orbits and multipliers against the exact flow, a closed form, finite differences of the map, and a brute-force run."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from tests.continuation.rigs import FINE, SOFT, STEPS, rig, settled
from tests.continuation.single_impact_orbit import Oscillator
from vibrojax.contact import HuntCrossleySeparate, KelvinVoigtClipped, LankaraniNikravesh, Newton, NoContact
from vibrojax.continuation import ForcedRig, find_orbit, settle
from vibrojax.continuation.orbit import landing_of, solved, state_scale
from vibrojax.continuation.rig import as_arrays, strobe_from
from vibrojax.effects.filters import ForceLag
from vibrojax.effects.forces import SecondMode
from vibrojax.effects.stops import GapDrift
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear


def reached(orbit, state):
    return np.asarray(strobe_from(STEPS, orbit.rig, jnp.asarray(orbit.cycles), jnp.asarray(state))[0])


@pytest.mark.parametrize("cycles", [1, 2])
def test_without_impact_the_monodromy_is_the_exact_flow(cycles):
    orbit = find_orbit(rig(frequency=7.0, gap=0.1), np.zeros(2), cycles=cycles, landing=FINE)
    omega = 2 * np.pi * 5.0
    flow = expm(np.array([[0.0, 1.0], [-(omega**2), -2 * 0.05 * omega]]) * cycles / 7.0)
    np.testing.assert_allclose(orbit.monodromy, flow, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(sorted(orbit.multipliers, key=np.imag), sorted(np.linalg.eigvals(flow), key=np.imag), rtol=1e-7)
    r = 7.0 / 5.0
    response = 1e-3 * r**2 / (1 - r**2 + 2j * 0.05 * r)
    np.testing.assert_allclose(orbit.state, [response.imag, 2 * np.pi * 7.0 * response.real], rtol=1e-7)
    assert orbit.stable and orbit.touches == 0
    assert float(orbit.passage.closest) == pytest.approx(abs(response) - 0.1, rel=1e-8)


@pytest.mark.parametrize("law", [SOFT, KelvinVoigtClipped(1e6, 2e-4), Newton(0.8)], ids=lambda law: law.name)
def test_the_monodromy_matrix_is_the_slope_of_the_map(law):
    orbit = settled(rig(law, frequency=6.6, gap=1e-3), (0.0, 0.0))
    assert orbit.touches >= 1
    scale, slope = state_scale(orbit.rig), np.empty((2, 2))
    for column, step in enumerate(1e-5 * scale):
        ahead, behind = (reached(orbit, orbit.state + sign * step * np.eye(2)[column]) for sign in (1, -1))
        slope[:, column] = (ahead - behind) / (2 * step)
    unit = scale[None, :] / scale[:, None]
    np.testing.assert_allclose(orbit.monodromy * unit, slope * unit, atol=1e-4 * np.abs(slope * unit).max())
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers)), np.sort(np.abs(np.linalg.eigvals(slope))), rtol=1e-4)


@pytest.mark.parametrize(("n", "frequency"), [(1, 7.5), (2, 15.0)])
@pytest.mark.parametrize("root", [0, 1])
def test_single_impact_orbits_are_those_of_shaw_and_holmes(n, frequency, root):
    exact = Oscillator(zeta=0.05, f_n=5.0, e=0.8, gap=3e-3, amplitude=1e-3)
    speed, monodromy, _ = exact.orbit(frequency, n, root)
    landing = Landing(flight_step=2e-4)
    forced = as_arrays(rig(Newton(0.8), frequency=frequency))
    # The section of the exact orbit lies at the impact: find its phase by letting the rig run from the impact to the cart's zero.
    orbit = find_orbit(forced, section_state(exact, forced, speed, n, frequency), cycles=n, landing=landing)
    assert orbit.touches == 1
    assert float(orbit.passage.fastest_touch) == pytest.approx(speed, rel=1e-8)
    expected = np.sort_complex(np.linalg.eigvals(monodromy).astype(complex))
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), expected, rtol=1e-6)
    assert orbit.stable == bool(root)


def section_state(exact, forced, speed, n, frequency):
    """State of the exact orbit when the cart next passes its middle, from the state after the impact by the linear flow."""
    omega, drive = 2 * np.pi * exact.f_n, 2 * np.pi * frequency
    r = drive / omega
    amplitude = exact.amplitude * r**2 / np.hypot(1 - r**2, 2 * exact.zeta * r)
    lag = np.arctan2(2 * exact.zeta * r, 1 - r**2)
    rates = np.array([[0.0, 1.0], [-(omega**2), -2 * exact.zeta * omega]])
    alpha, beta = (1 + exact.e) * speed * np.linalg.solve(expm(rates * n / frequency) - np.eye(2), np.array([0.0, 1.0]))
    angle = np.arctan2(exact.gap - alpha, -(exact.e * speed + beta) / drive)
    wait = ((-angle - lag) % (2 * np.pi)) / drive
    forced_part = amplitude * np.array([np.sin(-lag), drive * np.cos(-lag)])
    return expm(rates * wait) @ np.array([alpha, beta]) + forced_part


def test_brute_force_and_newton_agree_on_one_impact_in_two_cycles():
    forced = rig(Newton(0.8), frequency=4.905)
    state, cycles = settle(forced, np.zeros(2), transient=2000, landing=STEPS)
    assert cycles == 2
    orbit = find_orbit(forced, state, cycles=2, landing=STEPS)
    np.testing.assert_allclose(orbit.state, state, rtol=1e-3)
    assert orbit.stable and orbit.touches == 1


def with_effect(effect, *, gap: float) -> ForcedRig:
    return ForcedRig(Model(1.0, Linear(0.05, 5.0), SOFT, (effect,)), gap=gap, base_amplitude=1e-3, frequency_hz=7.0)


def test_an_effect_with_own_states_adds_multipliers():
    mode = SecondMode(mode_mass=0.1, mode_frequency_hz=11.0, mode_damping_ratio=0.03)
    orbit = find_orbit(with_effect(mode, gap=0.1), np.zeros(4), landing=STEPS)
    slope = np.stack(
        [(reached(orbit, orbit.state + step) - reached(orbit, orbit.state - step)) / 2e-4 for step in 1e-4 * np.eye(4)], axis=1
    )
    assert orbit.multipliers.shape == (4,)
    np.testing.assert_allclose(orbit.monodromy, slope, atol=1e-9 * np.abs(slope).max())


def test_a_drifting_stop_has_no_periodic_orbit():
    with pytest.raises(InputError, match="gap_drift does not repeat with the cart"):
        find_orbit(with_effect(GapDrift(1e-4), gap=1e-3), np.zeros(2), landing=STEPS)


def test_impossible_settings_are_refused():
    with pytest.raises(InputError, match="frequency is 0 Hz: expected a finite number above 0"):
        find_orbit(rig(frequency=0.0), np.zeros(2))
    with pytest.raises(InputError, match="unknown parameter 'speed': expected one of frequency, gap"):
        rig(frequency=7.0).replace("speed", 1.0)


def test_chaos_does_not_settle():
    with pytest.raises(NoConvergenceError, match="does not repeat within 2 cycles"):
        settle(rig(Newton(0.8), frequency=4.4), np.zeros(2), transient=300, most_cycles=2, landing=STEPS)


def test_a_section_in_contact_needs_a_law_that_forgets_its_touch():
    state = np.array([1e-3 + 1e-5, 0.01])  # into the stop
    forced = rig(LankaraniNikravesh(1e6, 1.5, 0.8), frequency=7.0, gap=1e-3)
    with pytest.raises(NoConvergenceError, match="in contact when the cart passes its middle, and lankarani-nikravesh depends"):
        find_orbit(forced, state, landing=STEPS)


def test_a_recorder_with_a_memory_is_no_part_of_the_rig():
    """The state of its filter moves by itself, and would have a multiplier of exactly 1."""
    bare = find_orbit(rig(frequency=8.0), np.zeros(2), landing=STEPS)
    lagging = dataclasses.replace(bare.rig, model=dataclasses.replace(bare.rig.model, effects=(ForceLag(lag=1e-3),)))
    assert lagging.size == 2
    np.testing.assert_allclose(find_orbit(lagging, np.zeros(2), landing=STEPS).multipliers, bare.multipliers)


def test_a_family_of_orbits_has_no_newton_step():
    with pytest.raises(NoConvergenceError, match="a multiplier is 1 exactly"):
        solved(np.zeros((2, 2)), np.ones(2))


def test_without_a_stop_nothing_is_touched_or_grazed():
    free = rig(frequency=8.0, gap=1e-4)
    orbit = find_orbit(dataclasses.replace(free, model=dataclasses.replace(free.model, law=NoContact())), np.zeros(2), landing=STEPS)
    assert orbit.touches == 0
    assert orbit.stable


def test_steps_are_as_fine_as_the_fastest_vibration_asks_for():
    mode = SecondMode(mode_mass=0.1, mode_frequency_hz=700.0, mode_damping_ratio=0.03)
    assert landing_of(rig(frequency=8.0)).flight_step == Landing().flight_step
    assert landing_of(with_effect(mode, gap=1e-3)).flight_step == pytest.approx(1.0 / (40.0 * 700.0))
    assert landing_of(rig(frequency=400.0)).flight_step == pytest.approx(1.0 / (200.0 * 400.0))


def test_units_of_parameters_may_hold_brackets():
    law = HuntCrossleySeparate(**{p.field: p.start for p in HuntCrossleySeparate.parameters})
    forced = rig(frequency=8.0)
    forced = dataclasses.replace(forced, model=dataclasses.replace(forced.model, law=law))
    assert forced.unit("lambda_i") == "s m^(n-n_2-1)"
    assert forced.label("lambda_i") == "λ_i (s m^(n-n_2-1))"
