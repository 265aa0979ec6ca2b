import numpy as np

from tests.effects.rig import GAP, K_I, LAMBDA, LAW, N_I, Reference, assert_same, simulate
from vibrojax.contact import NoContact
from vibrojax.effects import MissingStop


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(MissingStop(K_I, N_I, LAMBDA, 2e-4), law=NoContact())
    assert_same(readings, Reference(gap=lambda t, z: (GAP + 2e-4, 0.0)))


def test_is_the_nominal_stop_where_that_was_left_out_and_nothing_beside_it():
    stop = MissingStop(K_I, N_I, LAMBDA, 0.0)
    law, gap = stop.stop(NoContact(), GAP)
    assert (law, gap) == (LAW, GAP)
    other = MissingStop(1.0, 1.0, 1.0, 1.0).stop(LAW, GAP)
    assert other == (LAW, GAP)
    assert np.isfinite(gap)
