"""Lankarani–Nikravesh: the restitution that results against the one that was asked for."""

import pytest

from tests.contact.single_impact import hunt_crossley_restitution, single_impact
from vibrojax.contact import LankaraniNikravesh


def resulting(e, mass=0.4, speed=0.3, exponent=1.5):
    law = LankaraniNikravesh(impact_stiffness=1e7, impact_exponent=exponent, restitution=e)
    return single_impact(law, mass, speed).restitution


@pytest.mark.parametrize("e", [0.05, 0.5, 0.8, 0.95])
def test_restitution_is_hunt_and_crossleys(e):
    assert resulting(e) == pytest.approx(hunt_crossley_restitution(0.75 * (1 - e**2)), rel=1e-8)


@pytest.mark.parametrize(("mass", "speed", "exponent"), [(5.0, 0.3, 1.5), (0.4, 3.0, 1.5), (0.4, 0.3, 2.5)])
def test_restitution_is_the_same_at_every_speed(mass, speed, exponent):
    assert resulting(0.8, mass, speed, exponent) == pytest.approx(resulting(0.8), rel=1e-8)


def test_right_as_little_is_lost():
    for e, within in ((0.9, 0.13), (0.95, 0.07), (0.99, 0.02)):
        assert resulting(e) - e == pytest.approx(1.5 * (1 - e) ** 2, rel=within)
    assert resulting(1.0) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("asked", "got"), [(0.9, 0.9132), (0.8, 0.8471), (0.5, 0.7252), (0.01, 0.6630)])
def test_wrong_where_much_is_lost(asked, got):
    assert resulting(asked) == pytest.approx(got, abs=6e-5)
