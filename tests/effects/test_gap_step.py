import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.facts import FACTS
from tests.effects.rig import GAP, LAW, SUSPENSION, M, Reference, assert_same, simulate
from vibrojax.effects import GapStep
from vibrojax.model import Model

JUMP, INSTANT = 3e-4, 0.15
EFFECT = GapStep(gap_jump=JUMP, instant=INSTANT, in_file="cart2.csv")


def test_agrees_with_an_independent_integration():
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


def test_a_jump_in_flight_may_have_been_one_in_the_contacts_on_either_side_of_it():
    # Contacts of 0.02 to 0.03 s, 0.07 to 0.08 s and 0.12 to 0.13 s.
    (first,), (second,) = EFFECT.probes(FACTS)
    assert (first.in_file, first.instant, second.instant) == ("cart1.csv", 0.05, 0.1)
    assert [one.instant for one in second.other_places(FACTS)] == pytest.approx([0.0725, 0.0775, 0.1225, 0.1275])
    assert all(one.gap_jump == second.gap_jump for one in second.other_places(FACTS))
    late = dataclasses.replace(second, instant=0.2)
    assert [one.instant for one in late.other_places(FACTS)] == pytest.approx([0.1225, 0.1275])
    short = dataclasses.replace(FACTS, contacts={"cart1.csv": ((0.02, 0.02), (0.12, 0.12))})  # of one sample each
    assert [one.instant for one in second.other_places(short)] == pytest.approx([0.02, 0.12])
