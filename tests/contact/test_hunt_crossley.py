"""Hunt–Crossley against its closed-form restitution and the table of the thesis's parameter set."""

import numpy as np
import pytest

from tests.contact.single_impact import hunt_crossley_restitution, single_impact
from vibrojax.contact import HuntCrossley

THESIS = HuntCrossley(impact_stiffness=2.1e8, impact_exponent=1.6, impact_damping=0.6)
MASS = 2.0
# speed m/s, restitution, largest force N, deepest indentation um; an RK4 integration that shares no code with this package
TABLE = [
    (0.05, 0.9804, 70.8, 90),
    (0.1, 0.9615, 164, 152),
    (0.2, 0.9259, 378, 256),
    (0.5, 0.8329, 1124, 498),
    (1.0, 0.7120, 2568, 802),
    (2.0, 0.5469, 6076, 1250),
]


@pytest.mark.parametrize(("speed", "restitution", "force", "depth_um"), TABLE)
def test_table(speed, restitution, force, depth_um):
    impact = single_impact(THESIS, MASS, speed)
    assert impact.restitution == pytest.approx(restitution, abs=6e-5)
    assert impact.largest_force == pytest.approx(force, abs=0.06 if force < 100 else 0.6)
    assert impact.deepest * 1e6 == pytest.approx(depth_um, abs=0.6)


def test_contact_times():
    assert single_impact(THESIS, MASS, 0.05).duration * 1e3 == pytest.approx(5.30, abs=0.006)
    assert single_impact(THESIS, MASS, 2.0).duration * 1e3 == pytest.approx(2.50, abs=0.006)


@pytest.mark.parametrize("a", [0.03, 0.3, 1.0, 3.0])
@pytest.mark.parametrize(("mass", "stiffness", "exponent"), [(0.3, 1e6, 1.5), (5.0, 3e8, 1.0), (1.0, 1e9, 2.5)])
def test_restitution_depends_on_lambda_v_alone(a, mass, stiffness, exponent):
    law = HuntCrossley(impact_stiffness=stiffness, impact_exponent=exponent, impact_damping=a / 0.4)
    e = single_impact(law, mass, 0.4).restitution
    assert e == pytest.approx(hunt_crossley_restitution(a), rel=1e-8)
    assert a * (1 + e) == pytest.approx(np.log((1 + a) / (1 - a * e)), rel=1e-7)


@pytest.mark.parametrize("speed", [0.05, 0.5, 2.0])
def test_lost_energy_is_the_loop_area(speed):
    impact = single_impact(THESIS, MASS, speed)
    assert impact.loop_area == pytest.approx(0.5 * MASS * speed**2 * (1 - impact.restitution**2), rel=1e-7)
