"""What a fit warns of."""

import dataclasses

from identification.estimation.estimate import fit_experiment
from tests.identification.conftest import cropped


def test_a_gap_that_the_load_cell_contradicts_is_reported(example):
    """Set 5 mm wide of the truth: the load cell is struck where the hammer is said to be in flight."""
    drop = cropped(example, 800, (0,))
    wrong = dataclasses.replace(drop, records=(dataclasses.replace(drop.records[0], gap=5e-3),))
    assert any("short of the stop: check gap" in warning for warning in fit_experiment(wrong).warnings)
