"""Spring and dashpot that only push: the closed form of Schwager and Pöschel (2007)."""

import numpy as np
import pytest

from tests.contact.single_impact import single_impact
from vibrojax.contact import KelvinVoigtClipped

MASS, STIFFNESS = 0.4, 1e6
OMEGA = np.sqrt(STIFFNESS / MASS)


def closed_form(zeta):
    if zeta > 1:
        root = np.sqrt(zeta**2 - 1)
        return np.exp(-zeta / root * np.log((zeta + root) / (zeta - root)))
    root = np.sqrt(1 - zeta**2)
    return np.exp(-zeta / root * (np.pi - np.arctan2(2 * zeta * root, 1 - 2 * zeta**2)))


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.3, 0.707, 0.95, 1.5, 3.0])
def test_restitution(zeta):
    impact = single_impact(KelvinVoigtClipped(impact_stiffness=STIFFNESS, impact_damping=2 * zeta / OMEGA), MASS, 0.3)
    assert impact.restitution == pytest.approx(closed_form(zeta), rel=1e-8)
    assert impact.smallest_force == pytest.approx(0.0, abs=1e-7 * impact.largest_force)
    assert impact.smallest_force >= 0.0 or zeta == 0.0


@pytest.mark.parametrize("speed", [0.02, 2.0])
def test_restitution_is_the_same_at_every_speed(speed):
    law = KelvinVoigtClipped(impact_stiffness=STIFFNESS, impact_damping=2 * 0.4 / OMEGA)
    assert single_impact(law, MASS, speed).restitution == pytest.approx(closed_form(0.4), rel=1e-8)


def test_lost_energy_is_the_loop_area():
    impact = single_impact(KelvinVoigtClipped(impact_stiffness=STIFFNESS, impact_damping=2 * 0.4 / OMEGA), MASS, 0.3)
    assert impact.loop_area == pytest.approx(0.5 * MASS * 0.3**2 * (1 - impact.restitution**2), rel=1e-6)
