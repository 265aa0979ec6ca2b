"""Newton's restitution: a rigid stop."""

from typing import ClassVar

from vibrojax.contact.base import RESTITUTION, AbstractInstantaneousLaw
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value


class Newton(AbstractInstantaneousLaw):
    """Rigid stop: the velocity jumps at the touch, in no time and without indentation.

    v+ = -e v-; the impulse is m (1 + e) v-, the energy lost m (1 - e^2) v-^2 / 2.

    Linear, hence differentiable everywhere; a trajectory is not at a grazing touch (v- = 0).

    Arguments:
        restitution: e in (0, 1], 1.

    Source: I. Newton, Philosophiae naturalis principia mathematica (1687), scholium after the laws of motion.

    Example:
        >>> import jax.numpy as jnp
        >>> round(float(Newton(restitution=0.8).rebound_speed(jnp.asarray(0.5))), 6)
        0.4
    """

    name: ClassVar[str] = "newton"
    title: ClassVar[str] = "Newton's restitution (1687)"
    parameters: ClassVar[tuple[Parameter, ...]] = (RESTITUTION,)

    restitution: Value

    def rebound_speed(self, approach_speed: Scalars) -> Scalars:
        """|v+| = e v-, m/s."""
        return self.restitution * approach_speed
