import jax.numpy as jnp
import numpy as np

from tests.effects.rig import FINE, GAP, Reference, assert_same, simulate
from vibrojax.contact import HuntCrossley
from vibrojax.effects import ContactAdhesion, Motion
from vibrojax.excitation import Unforced, at_rest
from vibrojax.suspension import Free
from vibrojax.system import System

F_AD, D_AD = 0.5, 4e-4
ADHESION = ContactAdhesion(F_AD, D_AD)


def quintic(s):
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def pull(u, v):
    delta = (u - GAP) / D_AD
    return F_AD * np.clip(1 + delta, 0, 1) * quintic((0.1 - delta) / 0.1) * quintic(0.5 - v / 5e-4)


def test_agrees_with_an_independent_integration_and_the_load_cell_feels_the_pull():
    readings, trajectory = simulate(ADHESION)
    felt = pull(np.asarray(trajectory.u), np.asarray(trajectory.v))
    assert readings["impact_force"].min() < -0.5 * F_AD
    reference = Reference(extra=lambda t, u, v, z: pull(u, v))
    assert_same({**readings, "impact_force": readings["impact_force"] + felt}, reference, within=1e-4)


def test_pulls_only_on_the_way_out_and_inside_the_reach():
    delta = jnp.asarray([-1.1, -0.5, 0.0, 0.2, -0.5, -0.5]) * D_AD
    rate = jnp.asarray([-0.1, -0.1, -0.1, -0.1, 0.1, -3e-4])
    zero = jnp.zeros(6)
    motion = Motion(t=zero, u=zero, v=rate, indentation=delta, indentation_rate=rate, in_contact=delta > 0)
    np.testing.assert_allclose(ADHESION.force(motion, jnp.zeros((6, 0))), F_AD * np.array([0.0, 0.5, 1.0, 0.0, 0.0, 0.5]))


def test_a_free_hammer_pays_the_work_of_the_pull():
    # Outside the stop F_ad d_ad / 2, and inside, while it sets in, the half of F_ad d_ad / 10.
    law = HuntCrossley(impact_stiffness=2e7, impact_exponent=1.5, impact_damping=0.0)
    system = System(mass=0.5, suspension=Free(), law=law, gap=GAP, base=at_rest(), applied=Unforced(), effects=(ADHESION,))
    trajectory = FINE(system, jnp.linspace(0.0, 0.1, 101), jnp.asarray([0.0, 0.1]))
    lost = 0.5 * 0.5 * (0.1**2 - float(trajectory.v[-1]) ** 2)
    np.testing.assert_allclose(lost, 0.55 * F_AD * D_AD, rtol=1e-3)
