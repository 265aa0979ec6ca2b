import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from tests.effects.rig import GAP, LAW, SUSPENSION, M, Reference, assert_same, simulate
from tests.effects.scales import SCALES
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


def test_a_candidate_jumps_in_every_flight_between_contacts():
    # Contacts of 0.02 to 0.03 s, 0.07 to 0.08 s and 0.12 to 0.13 s.
    assert [(one.in_file, one.instant) for (one,) in GapStep.probe.candidates(SCALES)] == [("cart1.csv", 0.05), ("cart1.csv", 0.1)]
