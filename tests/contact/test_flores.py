"""Flores et al.: the restitution that results against the one that was asked for."""

import numpy as np
import pytest

from tests.contact.single_impact import hunt_crossley_restitution, single_impact
from vibrojax.contact import Flores


def resulting(e, mass=0.4, speed=0.3, exponent=1.5):
    return single_impact(Flores(impact_stiffness=1e7, impact_exponent=exponent, restitution=e), mass, speed).restitution


@pytest.mark.parametrize("e", [0.1, 0.3, 0.5, 0.8, 0.95])
def test_restitution_is_hunt_and_crossleys(e):
    assert resulting(e) == pytest.approx(hunt_crossley_restitution(1.6 * (1 - e) / e), rel=1e-7)


@pytest.mark.parametrize(("mass", "speed", "exponent"), [(5.0, 0.3, 1.5), (0.4, 3.0, 1.5), (0.4, 0.3, 2.5)])
def test_restitution_is_the_same_at_every_speed(mass, speed, exponent):
    assert resulting(0.6, mass, speed, exponent) == pytest.approx(resulting(0.6), rel=1e-8)


def test_close_over_the_whole_range():
    wanted = np.linspace(0.01, 0.99, 99)
    short = wanted - np.array([hunt_crossley_restitution(1.6 * (1 - e) / e) for e in wanted])
    assert np.all(short > 0.0)
    assert short.max() == pytest.approx(0.0454, abs=1e-4)
    assert wanted[np.argmax(short)] == pytest.approx(0.24, abs=0.015)


@pytest.mark.parametrize(("asked", "got"), [(0.9, 0.8939), (0.5, 0.4704), (0.1, 0.0694)])
def test_what_the_docstring_says(asked, got):
    assert resulting(asked) == pytest.approx(got, abs=6e-5)
