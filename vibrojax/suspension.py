"""What holds the hammer in the cart while it is away from the stop.

To add one: write a final subclass of `AbstractSuspension` here that gives `name`, declares its parameters as fields and implements
`acceleration`, then list it in `SUSPENSIONS`.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax.parameters import DeclaredParameters, Parameter
from vibrojax.shapes import Scalars, Value

DAMPING_RATIO = Parameter("zeta", "ζ", "1", field="damping_ratio", start=0.02, lower=1e-7, upper=2.0, meaning="damping ratio")
NATURAL_FREQUENCY = Parameter(
    "f_n", "f_n", "Hz", field="natural_frequency_hz", start=3.0, lower=1e-3, upper=1e4, meaning="natural frequency"
)


class AbstractSuspension(eqx.Module):
    """What holds the hammer in the cart while it is away from the stop."""

    name: eqx.AbstractClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = DeclaredParameters()  # type: ignore[assignment]
    """Those that the fields declare, in their order."""

    @abc.abstractmethod
    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration u'', m/s^2.

        Arguments:
            u: displacement of the hammer relative to the cart, m.
            v: its velocity, m/s.
            drive: everything else that acts on the hammer, per mass, in the cart's frame: -y'' + (applied - contact force) / m, m/s^2.
        """


class Linear(AbstractSuspension):
    """Linear spring and dashpot between hammer and cart.

    u'' = -2 zeta omega_n u' - omega_n^2 u + drive, with omega_n = 2 pi f_n. Differentiable everywhere.

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0, Hz.

    Source: thesis section 3.4 (beam springs), in modal form.

    Example:
        >>> suspension = Linear(damping_ratio=0.0, natural_frequency_hz=0.5)
        >>> round(float(suspension.acceleration(jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -9.8696
    """

    name: ClassVar[str] = "linear"

    damping_ratio: Value = DAMPING_RATIO.as_field()
    natural_frequency_hz: Value = NATURAL_FREQUENCY.as_field()

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        return drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * u


class Pendulum(AbstractSuspension):
    """Pendulum in a cart that moves horizontally, written in the horizontal displacement u = L sin(phi).

    L phi'' + 2 zeta omega_n L phi' + omega_n^2 L sin(phi) = drive cos(phi), hence with s = u / L and c = sqrt(1 - s^2)
    u'' = c^2 drive - 2 zeta omega_n u' - omega_n^2 c u - s u'^2 / (L c^2).

    omega_n^2 is g / L for a point mass on light wires and is estimated, so that a real body's inertia is covered. Valid for |u| < L
    (the wire short of horizontal); beyond, c^2 is cut at 1e-6 to stay finite and the motion means nothing. For small u / L this is
    `Linear`; the restoring acceleration at u is weaker by the factor c. Differentiable for |u| < L sqrt(1 - 1e-6).

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0 of small swings, Hz.
        length: L > 0, m; known, not estimated.

    Source: Lagrange's equation for the wires of thesis section 3.3, damping proportional to the angular rate; ours.

    Example:
        >>> suspension = Pendulum(damping_ratio=0.0, natural_frequency_hz=0.5, length=2.0)
        >>> round(float(suspension.acceleration(jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -8.5473
    """

    name: ClassVar[str] = "pendulum"

    damping_ratio: Value = DAMPING_RATIO.as_field()
    natural_frequency_hz: Value = NATURAL_FREQUENCY.as_field()
    length: float = eqx.field(static=True)  # type: ignore[misc]  # a declared parameter looks like a default, and is none

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        sine = u / self.length
        cosine_squared = jnp.maximum(1.0 - sine**2, 1e-6)
        centripetal = sine * v**2 / (self.length * cosine_squared)
        return cosine_squared * drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * jnp.sqrt(cosine_squared) * u - centripetal


class Pivot(AbstractSuspension):
    """Pendulum on a bearing, written in the arc u = L phi, so that it may swing past horizontal.

    L phi'' + 2 zeta omega_n L phi' + omega_n^2 L sin(phi) = drive, hence u'' = drive - 2 zeta omega_n u' - omega_n^2 L sin(u / L).

    The drive acts along the arc, which is what friction in the bearing, drag and a stop at radius L do. A cart that moves does so only
    at small angles: use it with a cart at rest, or `Pendulum`. omega_n^2 is m g r / J of a body of moment of inertia J whose centre of mass
    lies at r, and is estimated; m is then J / L^2. Differentiable everywhere.

    Arguments:
        damping_ratio: zeta >= 0, 1.
        natural_frequency_hz: f_n > 0 of small swings, Hz.
        length: L > 0, m, at which the displacement is measured; with L = 1 m it is the angle in radians.

    Source: Euler's equation for a body on a fixed axis; ours.

    Example:
        >>> suspension = Pivot(damping_ratio=0.0, natural_frequency_hz=0.5, length=2.0)
        >>> round(float(suspension.acceleration(jnp.asarray(jnp.pi), jnp.asarray(0.0), jnp.asarray(0.0))), 4)
        -19.7392
    """

    name: ClassVar[str] = "pivot"

    damping_ratio: Value = DAMPING_RATIO.as_field()
    natural_frequency_hz: Value = NATURAL_FREQUENCY.as_field()
    length: float = eqx.field(static=True)  # type: ignore[misc]  # a declared parameter looks like a default, and is none

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        omega_n = 2.0 * jnp.pi * self.natural_frequency_hz
        return drive - 2.0 * self.damping_ratio * omega_n * v - omega_n**2 * self.length * jnp.sin(u / self.length)


class Free(AbstractSuspension):
    """No spring, no damper: a body that moves freely between impacts, such as a rider on an air track.

    u'' = drive. Differentiable everywhere.

    Example:
        >>> import jax.numpy as jnp
        >>> float(Free().acceleration(jnp.asarray(1.0), jnp.asarray(2.0), jnp.asarray(3.0)))
        3.0
    """

    name: ClassVar[str] = "free"

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        return drive


SUSPENSIONS: dict[str, type[AbstractSuspension]] = {suspension.name: suspension for suspension in (Linear, Pendulum, Pivot, Free)}
