"""What may be wrong with a stop, against an independent integration, and where candidates stand."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import FINE, GAP, K_I, LAMBDA, LAW, N_I, SUSPENSION, M, Reference, assert_same, simulate, system
from tests.effects.scales import SCALES
from vibrojax.contact import HuntCrossley, Newton, NoContact
from vibrojax.effects import BackStop, ContactAdhesion, DeepStop, FallingRestitution, GapDrift, GapStep, MissingStop, Motion, StopCompliance
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.suspension import Free
from vibrojax.system import System

# Stop compliance


K_S, F_S, ZETA_S = 5e5, 480.0, 0.04
M_S = K_S / (2 * np.pi * F_S) ** 2
C_S = 2 * ZETA_S * np.sqrt(K_S * M_S)


def test_agrees_with_an_independent_integration_and_the_load_cell_is_behind_the_stop():
    readings, trajectory = simulate(StopCompliance(K_S, F_S, ZETA_S))
    reference = Reference(
        own_rates=lambda t, x, v, z, pushed, a: [z[1], (pushed - K_S * z[0] - C_S * z[1]) / M_S],
        own=[0.0, 0.0],
        gap=lambda t, z: (GAP + z[0], z[1]),
    )
    _, _, z, _ = reference()
    behind = K_S * z[:, 0] + C_S * z[:, 1]
    np.testing.assert_allclose(readings["impact_force"], behind, atol=1e-4 * behind.max())
    assert behind.min() < -0.02 * behind.max()
    assert_same({**readings, "impact_force": reference()[1]}, reference, within=1e-4)


# Contact adhesion


F_AD, D_AD = 0.5, 4e-4
ADHESION = ContactAdhesion(F_AD, D_AD)


def quintic(s):
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def pull(u, v):
    delta = (u - GAP) / D_AD
    return F_AD * np.clip(1 + delta, 0, 1) * quintic((0.1 - delta) / 0.1) * quintic(0.5 - v / 5e-4)


def test_agrees_with_an_independent_integration_and_the_load_cell_feels_the_pull():
    readings, trajectory = simulate(ADHESION)
    felt = pull(np.asarray(trajectory.u), np.asarray(trajectory.v))
    assert readings["impact_force"].min() < -0.5 * F_AD
    reference = Reference(extra=lambda t, u, v, z: pull(u, v))
    assert_same({**readings, "impact_force": readings["impact_force"] + felt}, reference, within=1e-4)


def test_pulls_only_on_the_way_out_and_inside_the_reach():
    delta = jnp.asarray([-1.1, -0.5, 0.0, 0.2, -0.5, -0.5]) * D_AD
    rate = jnp.asarray([-0.1, -0.1, -0.1, -0.1, 0.1, -3e-4])
    zero = jnp.zeros(6)
    motion = Motion(t=zero, u=zero, v=rate, indentation=delta, indentation_rate=rate, in_contact=delta > 0)
    np.testing.assert_allclose(ADHESION.force(motion, jnp.zeros((6, 0))), F_AD * np.array([0.0, 0.5, 1.0, 0.0, 0.0, 0.5]))


def test_a_free_hammer_pays_the_work_of_the_pull():
    # Outside the stop F_ad d_ad / 2, and inside, while it sets in, the half of F_ad d_ad / 10.
    law = HuntCrossley(impact_stiffness=2e7, impact_exponent=1.5, impact_damping=0.0)
    system = System(mass=0.5, suspension=Free(), law=law, gap=GAP, base=at_rest(), applied=Unforced(), effects=(ADHESION,))
    trajectory = FINE(system, jnp.linspace(0.0, 0.1, 101), jnp.asarray([0.0, 0.1]))
    lost = 0.5 * 0.5 * (0.1**2 - float(trajectory.v[-1]) ** 2)
    np.testing.assert_allclose(lost, 0.55 * F_AD * D_AD, rtol=1e-3)


# Back stop


def test_back_stop_agrees_with_an_independent_integration():
    # The load cell in front does not feel the stop behind; the accelerometer does.
    readings, _ = simulate(BackStop(2.5e-3))
    reference = Reference(back_gap=2.5e-3)
    assert_same(readings, reference, touches=4)
    assert reference()[0].min() < -2.5e-3


# Missing stop


def test_missing_stop_agrees_with_an_independent_integration():
    readings, _ = simulate(MissingStop(K_I, N_I, LAMBDA, 2e-4), law=NoContact())
    assert_same(readings, Reference(gap=lambda t, z: (GAP + 2e-4, 0.0)))


def test_stands_where_the_hammer_just_gets_to_if_no_stop_was_stated():
    scales = dataclasses.replace(SCALES, law=NoContact(), gaps={"drop.csv": 1.0, "cart1.csv": 1.0})
    found = [candidate[0] for candidate in MissingStop.probe.candidates(scales)]
    assert all(1.0 + one.gap_offset == pytest.approx(0.98 * scales.amplitude) for one in found)
    stated = dataclasses.replace(scales, gaps={"drop.csv": 0.0, "cart1.csv": 1.0})
    assert all(candidate[0].gap_offset == 0.0 for candidate in MissingStop.probe.candidates(stated))


def test_candidates_scale_with_the_rig():
    """Lengths a tenth and speeds threefold: the indentation of an impact at the largest speed is a tenth too."""
    slow = dataclasses.replace(SCALES, law=NoContact(), gaps={"drop.csv": 0.0})
    fast = dataclasses.replace(slow, amplitude=0.1 * slow.amplitude, speed=3.0 * slow.speed)
    for (one,), (other,) in zip(MissingStop.probe.candidates(slow), MissingStop.probe.candidates(fast), strict=True):
        before, after = (_deepest(stop, scales) for stop, scales in ((one, slow), (other, fast)))
        assert after == pytest.approx(0.1 * before)
        assert before < slow.amplitude


def _deepest(stop: MissingStop, scales) -> float:
    """Where the energy of the largest speed is stored, m."""
    order = stop.impact_exponent + 1.0
    return (0.5 * order * scales.mass * scales.speed**2 / stop.impact_stiffness) ** (1.0 / order)


def test_is_the_nominal_stop_where_that_was_left_out_and_nothing_beside_it():
    stop = MissingStop(K_I, N_I, LAMBDA, 0.0)
    law, gap = stop.stop(NoContact(), GAP)
    assert (law, gap) == (LAW, GAP)
    other = MissingStop(1.0, 1.0, 1.0, 1.0).stop(LAW, GAP)
    assert other == (LAW, GAP)
    assert np.isfinite(gap)


# Deep stop


K_D, DEPTH, DAMPING = 4e8, 6e-5, 0.8
DEEP = DeepStop(K_D, DEPTH, DAMPING)


def behind(u, v):
    return K_D * np.maximum(u - GAP - DEPTH, 0.0) ** 1.5 * np.maximum(1 + DAMPING * v, 0.0)


def test_agrees_with_an_independent_integration_and_the_load_cell_feels_it():
    readings, trajectory = simulate(DEEP)
    deep = behind(np.asarray(trajectory.u), np.asarray(trajectory.v))
    assert deep.max() > 0.3 * readings["impact_force"].max()
    reference = Reference(extra=lambda t, u, v, z: -behind(u, v))
    assert_same({**readings, "impact_force": readings["impact_force"] - deep}, reference, within=2e-4)


def test_out_of_reach_it_changes_nothing():
    with_it, without = simulate(DeepStop(K_D, 1e-2, DAMPING))[0], simulate()[0]
    np.testing.assert_allclose(with_it["impact_force"], without["impact_force"], rtol=0, atol=1e-9)


def test_a_free_hammer_turns_where_both_stops_have_taken_its_energy():
    law = HuntCrossley(impact_stiffness=K_I, impact_exponent=N_I, impact_damping=0.0)
    rig = System(
        mass=0.5, suspension=Free(), law=law, gap=0.0, base=at_rest(), applied=Unforced(), effects=(dataclasses.replace(DEEP, damping=0.0),)
    )
    rig = dataclasses.replace(rig, law=rig.effects[0].stop(law, 0.0)[0])
    trajectory = Landing(contact_steps=400.0, flight_step=1e-4)(rig, jnp.linspace(0.0, 0.02, 20001), jnp.asarray([-1e-3, 0.2]))
    deepest = float(trajectory.u.max())
    assert deepest > DEPTH
    taken = K_I * deepest**2.5 / 2.5 + K_D * (deepest - DEPTH) ** 2.5 / 2.5
    np.testing.assert_allclose(taken, 0.5 * 0.5 * 0.2**2, rtol=1e-4)
    np.testing.assert_allclose(float(trajectory.v[-1]), -0.2, rtol=1e-5)


def test_steps_become_shorter_only_where_it_may_be_reached():
    law, mass = DEEP.stop(LAW, GAP)[0], jnp.asarray(0.5)
    assert law.contact_time(mass, jnp.asarray(1e-4)) == LAW.contact_time(mass, jnp.asarray(1e-4))
    assert law.contact_time(mass, jnp.asarray(0.2)) < 0.5 * LAW.contact_time(mass, jnp.asarray(0.2))
    assert DEEP.scaled(0.0).stop(LAW, GAP)[0].contact_time(mass, jnp.asarray(0.2)) == LAW.contact_time(mass, jnp.asarray(0.2))


def test_what_carries_the_stop_feels_both():
    u, v = jnp.asarray(GAP + 2 * DEPTH), jnp.asarray(0.0)
    push = system(DEEP).forces(jnp.asarray(0.0), u, v, jnp.zeros(0), jnp.asarray(True), jnp.asarray(0.1)).push
    np.testing.assert_allclose(push, K_I * (2 * DEPTH) ** N_I + behind(GAP + 2 * DEPTH, 0.0), rtol=1e-12)


def test_candidates_lie_within_the_indentation_and_push_as_much_as_the_nominal_stop():
    found = [candidate[0] for candidate in DeepStop.probe.candidates(SCALES)]
    assert len({one.depth for one in found}) == len(found) > 1
    for one in found:
        assert 0.0 < one.depth < SCALES.deepest
        assert one.stiffness * (SCALES.deepest - one.depth) ** 1.5 == pytest.approx(SCALES.force)
    assert DeepStop.probe.candidates(dataclasses.replace(SCALES, deepest=0.0)) == ()
    assert DeepStop.probe.candidates(dataclasses.replace(SCALES, law=NoContact())) == ()
    assert not DeepStop.probe.is_stop


# Falling restitution


def test_restitution_falls_by_a_power_of_the_speed_and_is_never_above_one():
    law, gap = FallingRestitution(power=0.5, reference_speed=0.4).stop(Newton(0.6), GAP)
    speed = np.array([0.0, 0.01, 0.1, 0.4, 1.6])
    np.testing.assert_allclose(law.rebound_speed(jnp.asarray(speed)), [0.0, 0.01, 0.1, 0.24, 0.48], atol=1e-12)
    assert gap == GAP


def test_a_stop_that_gives_way_keeps_its_law():
    assert FallingRestitution(0.5, 0.4).stop(LAW, GAP) == (LAW, GAP)
    assert FallingRestitution.probe.candidates(SCALES) == ()


# Gap drift


def test_gap_drift_agrees_with_an_independent_integration():
    # Exaggerated, so that the rate of the stop shows in the damping of its force.
    readings, _ = simulate(GapDrift(5e-3))
    assert_same(readings, Reference(gap=lambda t, z: (GAP + 5e-3 * t, 5e-3)))


# Gap step


JUMP, INSTANT = 3e-4, 0.15
EFFECT = GapStep(gap_jump=JUMP, instant=INSTANT, in_file="cart2.csv")


def test_gap_step_agrees_with_an_independent_integration():
    # The jump falls into a flight, so that only the place of the stop before and after it counts.
    readings, trajectory = simulate(EFFECT)
    assert not bool(trajectory.in_contact[int(INSTANT / 5e-4)])
    assert_same(readings, Reference(gap=lambda t, z: (GAP + (JUMP if t > INSTANT else 0.0), 0.0)), touches=3)


def test_speed_is_the_derivative_of_place():
    ts, own = INSTANT + jnp.linspace(-1e-3, 1e-3, 41), jnp.zeros((0,))
    slope = jax.vmap(jax.grad(lambda t: EFFECT.stop_position(t, own)))(ts)
    np.testing.assert_allclose(EFFECT.stop_velocity(ts, own), slope, atol=1e-12)


def test_acts_in_its_record_only():
    model = Model(mass=M, suspension=SUSPENSION, law=LAW, effects=(EFFECT,))
    (here,), (there,) = (model.in_record(lambda file, name=name: float(file == name)).effects for name in ("cart2.csv", "drop.csv"))
    assert (here.gap_jump, there.gap_jump) == (JUMP, 0.0)
    assert dataclasses.replace(EFFECT, in_file="").record is None


def test_a_candidate_jumps_in_every_flight_between_contacts():
    # Contacts of 0.02 to 0.03 s, 0.07 to 0.08 s and 0.12 to 0.13 s.
    assert [(one.in_file, one.instant) for (one,) in GapStep.probe.candidates(SCALES)] == [("cart1.csv", 0.05), ("cart1.csv", 0.1)]
