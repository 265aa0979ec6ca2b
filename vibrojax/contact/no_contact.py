"""No stop at all."""

from typing import ClassVar

import jax.numpy as jnp

from vibrojax.contact.base import AbstractCompliantLaw
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars

NOWHERE = 1e6
"""m; where the stop of such a rig is put, so that nothing passes it."""


class NoContact(AbstractCompliantLaw):
    """A hammer with nothing in front of it: F = 0.

    Example:
        >>> float(NoContact().force(jnp.asarray(1e-3), jnp.asarray(0.1), jnp.asarray(0.1)))
        0.0
    """

    name: ClassVar[str] = "none"
    title: ClassVar[str] = "no contact"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """Zero, N."""
        return jnp.zeros_like(indentation)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Without end, s: it asks for no finer steps."""
        return jnp.full_like(approach_speed, jnp.inf)
