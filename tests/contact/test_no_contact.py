import jax.numpy as jnp
import numpy as np

from vibrojax.contact import NoContact
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.suspension import Free
from vibrojax.system import System


def test_a_hammer_flies_on():
    system = System(mass=1.0, suspension=Free(), law=NoContact(), gap=1e-3, base=at_rest(), applied=Unforced())
    ts = jnp.linspace(0.0, 0.1, 11)
    trajectory = Landing()(system, ts, jnp.asarray([0.0, 0.2]))
    assert int(trajectory.result) == 0
    np.testing.assert_allclose(trajectory.u, 0.2 * ts, atol=1e-16)
