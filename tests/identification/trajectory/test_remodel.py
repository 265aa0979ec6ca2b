"""Chains under another model."""

import dataclasses

import numpy as np

from identification.trajectory.remodel import remodelled
from identification.trajectory.segments import OF_RECORD
from identification.trajectory.start import Problem
from vibrojax.effects import MissingStop


def test_gaps_are_set_with_an_error_beside_a_missing_stop(vibrating: Problem):
    """But for that of the record that goes farthest, from which the stop's place is counted: the second one."""
    place = OF_RECORD.index("gap_error")
    model = dataclasses.replace(vibrating.model, effects=(MissingStop(1e6, 1.5, 0.3, 0.0),))
    with_stop = remodelled(vibrating, vibrating.start, model)
    assert with_stop.border.own[:, place].tolist() == [True, False]
    again = remodelled(with_stop, with_stop.start, vibrating.model)
    assert not np.any(again.border.own[:, place])
