"""What is known to push the hammer at all times: gravity along an incline, and a constant force."""

import math

import equinox as eqx
import jax.numpy as jnp
from scipy.constants import g as STANDARD_GRAVITY

from vibrojax.shapes import Value


class Load(eqx.Module):
    """Constant forces on the hammer that are known, not estimated; positive towards the stop, as displacements and forces are.

    F = m g sin(incline) + constant_force, with g = 9.80665 m/s^2. It enters the equation of motion of every suspension as an applied force
    does, along the displacement. What is not known of it is the effect `constant_force`.

    Arguments:
        incline: angle of the rail to the horizontal, rad; positive where the stop lies downhill.
        constant_force: N.

    Example:
        >>> round(float(Load(incline=0.1, constant_force=-0.2).force(2.0)), 4)
        1.7581
    """

    incline: Value = 0.0
    constant_force: Value = 0.0

    @property
    def acts(self) -> bool:
        """Whether there is any; needs concrete values."""
        return bool(self.incline != 0.0 or self.constant_force != 0.0)

    def force(self, mass: Value) -> Value:
        """The sum, N, on a hammer of that mass, kg."""
        sine = math.sin(self.incline) if isinstance(self.incline, float) else jnp.sin(self.incline)
        return mass * STANDARD_GRAVITY * sine + self.constant_force
