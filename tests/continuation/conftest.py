"""Branches that several files of this folder look at."""

import pytest

from tests.continuation.rigs import FINE, STEPS, rig, settled
from vibrojax.contact import Newton
from vibrojax.continuation import Branch, follow


@pytest.fixture(scope="session")
def soft() -> Branch:
    """A compliant stop: from rest to beyond the resonance."""
    return follow(settled(rig(frequency=4.0)), "frequency", (4.0, 9.0), landing=STEPS)


@pytest.fixture(scope="session")
def rigid() -> Branch:
    """A rigid stop."""
    return follow(settled(rig(Newton(0.8), frequency=7.0), (-9e-3, 0.06), FINE), "frequency", (4.2, 9.0), landing=FINE)
