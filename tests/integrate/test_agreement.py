"""Landing = switch model = SciPy oracle, for every law, over several impacts."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.integrate import rigs
from vibrojax.integrate import Landing, Smoothed, Switch

TS = np.linspace(0.0, 0.9, 451)
DRIVEN, DROPPED = rigs.RIG | rigs.STATE, rigs.DROP | rigs.DROP_STATE
each_law = pytest.mark.parametrize("law", rigs.LAWS)
each_rig = pytest.mark.parametrize("rig", [DRIVEN, DROPPED], ids=["harmonic base", "drop test"])


def run(integrator, p, law):
    motion = integrator(rigs.system(p, law), jnp.asarray(TS), jnp.array([p["u0"], p["v0"]]))
    assert int(motion.result) == 0
    return motion


@each_rig
@each_law
def test_all_agree(rig, law):
    p = rig | rigs.LAWS[law][0]
    truth = rigs.oracle_motion(p, law, TS)
    assert len(truth.impacts) >= 4
    swing = np.ptp(truth.u)

    switch, landing = run(Switch(), p, law), run(Landing(), p, law)
    assert np.abs(switch.u - truth.u).max() < 2e-9 * swing
    assert np.abs(landing.u - truth.u).max() < 1e-4 * swing
    assert np.array_equal(switch.in_contact, landing.in_contact)
    finer = run(Landing(contact_steps=500.0, flight_step=5e-4, most_steps=200_000), p, law)
    assert np.abs(finer.u - truth.u).max() < 2e-6 * swing

    last = np.searchsorted([impact.t for impact in truth.impacts], TS) - 1
    approach_speed = np.where(last >= 0, np.array([impact.v_minus for impact in truth.impacts])[last], switch.approach_speed[0])
    assert np.abs(switch.approach_speed - approach_speed)[1:].max() < 1e-8
    assert np.abs(landing.approach_speed - approach_speed)[1:].max() < 1e-3


@pytest.mark.parametrize("law", ["hunt-crossley", "kelvin-voigt", "lankarani-nikravesh"])
def test_a_narrow_smoothing_is_the_discontinuous_law(law):
    p = DRIVEN | rigs.LAWS[law][0]
    switch, smoothed = run(Switch(), p, law), run(Smoothed(smoothing=1e-8, rtol=1e-9, atol=1e-12), p, law)
    assert np.abs(smoothed.u - switch.u).max() < 1e-7 * np.ptp(switch.u)


def test_a_lane_reads_its_last_sample_whatever_the_other_lanes_do():
    """Two lanes side by side, one of which ends before the other, against each alone."""
    p = DROPPED | rigs.LAWS["hunt-crossley"][0]
    system = rigs.system(p, "hunt-crossley")
    many = jax.tree.map(lambda leaf: jnp.stack([jnp.asarray(leaf, float)] * 2), system)
    begin = jnp.array([[-5e-3, 0.0], [-2e-3, 0.1]])
    lengths = jnp.array([len(TS), len(TS)])
    together = Landing().batch(many, jnp.asarray(np.stack([TS, TS])), begin, lengths)
    for lane in range(2):
        alone = Landing()(system, jnp.asarray(TS), begin[lane])
        assert np.allclose(together.v[lane, -1], alone.v[-1], rtol=1e-9)
        assert np.allclose(together.u[lane], alone.u, rtol=0.0, atol=1e-12)
