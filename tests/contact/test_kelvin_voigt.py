"""Linear spring and dashpot: half a period of a damped oscillator."""

import jax.numpy as jnp
import numpy as np
import pytest

from tests.contact.single_impact import single_impact
from vibrojax.contact import KelvinVoigt
from vibrojax.excitation import Unforced, at_rest
from vibrojax.suspension import Free
from vibrojax.system import System

MASS, STIFFNESS = 0.4, 1e6
OMEGA = np.sqrt(STIFFNESS / MASS)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.3, 0.8])
@pytest.mark.parametrize("speed", [0.05, 1.0])
def test_restitution_and_duration(zeta, speed):
    impact = single_impact(KelvinVoigt(impact_stiffness=STIFFNESS, impact_damping=2 * zeta / OMEGA), MASS, speed)
    root = np.sqrt(1 - zeta**2)
    assert impact.restitution == pytest.approx(np.exp(-np.pi * zeta / root), rel=1e-9)
    assert impact.duration == pytest.approx(np.pi / (OMEGA * root), rel=1e-9)
    assert impact.deepest == pytest.approx(speed / OMEGA * np.exp(-zeta / root * np.arccos(zeta)), rel=1e-9)
    assert impact.loop_area == pytest.approx(0.5 * MASS * speed**2 * (1 - impact.restitution**2), rel=1e-8, abs=1e-10 * speed**2)


def test_pulls_while_leaving_by_what_the_dashpot_holds():
    law = KelvinVoigt(impact_stiffness=STIFFNESS, impact_damping=2 * 0.3 / OMEGA)
    impact = single_impact(law, MASS, 0.5)
    held = -STIFFNESS * law.impact_damping * impact.restitution * 0.5
    assert impact.smallest_force <= held * (1 - 1e-12) < 0.0  # equal but for rounding


def test_a_load_cell_behind_the_stop_is_pulled_as_the_hammer_is():
    law = KelvinVoigt(impact_stiffness=STIFFNESS, impact_damping=1e-3)
    system = System(mass=MASS, suspension=Free(), law=law, base=at_rest(), gap=0.0, applied=Unforced(), effects=())
    state = (jnp.asarray(1e-5), jnp.asarray(-0.2))
    forces = system.forces(jnp.asarray(0.0), *state, jnp.zeros(0), jnp.asarray(True), jnp.asarray(0.2))
    assert float(forces.push) == pytest.approx(STIFFNESS * (1e-5 - 1e-3 * 0.2))
    assert float(forces.push) == pytest.approx(-MASS * float(forces.absolute))
