"""Experiments that several tests of the fit share."""

import pytest

from identification.experiment import Experiment
from tests.identification.trajectory.conftest import shaken


@pytest.fixture(scope="session")
def shaken_records() -> Experiment:
    """One short record of a hammer without a stop."""
    return shaken(1)
