import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import GAP, K_I, LAW, N_I, Reference, assert_same, simulate, system
from tests.effects.scales import SCALES
from vibrojax.contact import HuntCrossley, NoContact
from vibrojax.effects import DeepStop
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.suspension import Free
from vibrojax.system import System

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
