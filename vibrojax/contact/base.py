"""What every contact law is.

Signs, once for the whole program: the indentation delta = u - gap grows into the stop, contact is delta > 0, and a law returns the
magnitude of the push that the stop gives back to the hammer (positive in compression).

To add one: write a final subclass of `AbstractCompliantLaw` that gives `name` and `title`, declares its parameters as fields and implements
`force` and `contact_time`, then import it in `vibrojax/contact/__init__.py`.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from vibrojax import smooth
from vibrojax.parameters import DeclaredParameters, Parameter
from vibrojax.shapes import Number, Scalars, Value
from vibrojax.steps import runge_kutta_step

SLOWEST_APPROACH = 1e-6
"""m/s; laws calibrated by a restitution take a slower approach as this one, so that a grazing touch or a resting contact stays finite."""
_RESTITUTION_STEPS, _MOST_STEPS = 200, 40_000
"""Of the integration for a restitution, in a law's rough contact time and at most."""
_RESOLVED = 2e-3
"""Error of a restitution that the steps may leave."""


class AbstractContactLaw(eqx.Module):
    """A relation between the motion of the hammer against the stop and the force or impulse of the stop."""

    name: eqx.AbstractClassVar[str]
    """Name on the command line and in `model.json`."""
    title: eqx.AbstractClassVar[str]
    """Name in printed tables, with author and year."""
    parameters: ClassVar[tuple[Parameter, ...]] = DeclaredParameters()  # type: ignore[assignment]
    """Those that the fields declare, in their order."""


class AbstractCompliantLaw(AbstractContactLaw):
    """A law of a compliant stop: the force follows from indentation and its rate."""

    @abc.abstractmethod
    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """Force in contact, N.

        Inside contact only: the caller switches the force off in flight. At delta = 0 it is the limit from inside, which a law that jumps
        at touch needs.

        Arguments:
            indentation: delta >= 0, m.
            rate: d(delta)/dt, m/s.
            approach_speed: speed at the touch that began this contact, m/s; only laws calibrated by a restitution use it.
        """

    @abc.abstractmethod
    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Rough duration of an impact, s: integrators choose their steps by it, so it need only be right within a factor of two.

        Arguments:
            mass: kg.
            approach_speed: m/s, above zero.
        """


class AbstractInstantaneousLaw(AbstractContactLaw):
    """A law in which the stop is rigid: the velocity jumps at the touch."""

    @abc.abstractmethod
    def rebound_speed(self, approach_speed: Scalars) -> Scalars:
        """Speed after the impact, m/s, from the speed before it, m/s."""


def smoothed_force(law: AbstractCompliantLaw, indentation: Scalars, rate: Scalars, approach_speed: Scalars, smoothing: Number) -> Scalars:
    """Force of a law whose contact switch is spread over the width epsilon (`smoothing`, m).

    F_eps = H_eps(delta) F(R_eps(delta), delta'), with H_eps a quintic switch on [-eps/2, eps/2] and R_eps its integral, so that flight
    further than eps/2 from the stop stays exactly free. With `smoothing` 0 this is the discontinuous law.

    As H_eps is the slope of R_eps, a free mass meets R_eps as it would meet delta: its speed as a function of R_eps, hence restitution and
    lost energy, are those of the discontinuous law at every width, and depth too if it is above eps/2; the time spent is not, by an error
    of order eps^(n+2).
    The force itself is wrong for |delta| < eps/2, by at most something of order eps^n (n = 0 for a force that jumps at touch).
    """
    return smooth.step(indentation, smoothing) * law.force(smooth.ramp(indentation, smoothing), rate, approach_speed)


def uses_approach_speed(law: AbstractCompliantLaw) -> bool:
    """Whether the force of a law depends on the speed of the touch, read off the traced computation."""
    scalar = jnp.asarray(0.0)
    traced = jax.make_jaxpr(lambda speed: law.force(scalar, scalar, speed))(scalar)
    speed = traced.jaxpr.invars[0]
    return any(used is speed for equation in traced.jaxpr.eqns for used in equation.invars)


def power_law_contact_time(stiffness: Number, exponent: Number, mass: Scalars, approach_speed: Scalars) -> Scalars:
    """Duration of an elastic impact on F = k delta^n, taken as 3 delta_max / v, s.

    The exact factor, 2 sqrt(pi) Gamma(1 + 1/(n+1)) / Gamma(1/2 + 1/(n+1)), is 3.25 for n = 0.8, pi for n = 1, 2.94 for n = 1.5 and
    2.51 for n = 4.
    """
    n1 = exponent + 1.0
    deepest = smooth.power(0.5 * n1 * mass * approach_speed**2 / stiffness, 1.0 / n1)
    return 3.0 * deepest / approach_speed


IMPACT_STIFFNESS = Parameter("k_i", "k_i", "N/m^n", field="impact_stiffness", start=1e6, lower=1.0, upper=1e13, meaning="contact stiffness")
IMPACT_EXPONENT = Parameter(
    "n", "n", "1", field="impact_exponent", start=1.5, lower=0.8, upper=4.0, logarithmic=False, meaning="contact exponent"
)
IMPACT_DAMPING = Parameter(
    "lambda_i", "λ_i", "s/m", field="impact_damping", start=0.3, lower=1e-6, upper=1e3, meaning="contact damping factor"
)
RESTITUTION = Parameter(
    "e", "e", "1", field="restitution", start=0.7, lower=1e-3, upper=1.0, most=1.0, logarithmic=False, meaning="restitution"
)
LINEAR_STIFFNESS = Parameter("k_i", "k_i", "N/m", field="impact_stiffness", start=1e6, lower=1.0, upper=1e13, meaning="contact stiffness")
LINEAR_DAMPING = Parameter(
    "lambda_i", "λ_i", "s", field="impact_damping", start=1e-4, lower=1e-9, upper=1.0, meaning="contact damping time"
)


@eqx.filter_jit
def restitution(law: AbstractContactLaw, mass: Value, approach_speed: Float[Array, " speeds"]) -> Float[Array, " speeds"]:
    """Speed at which a free mass leaves the stop over that at which it came; m delta'' = -F(delta, delta') from touch to delta = 0.

    Classical Runge-Kutta with fixed steps, which resolves e to 5e-5, or to 2e-3 where a far harder stop is behind a soft one.

    Args:
        law: of the contact.
        mass: kg.
        approach_speed: m/s, above zero.

    Returns:
        e by speed, 0 to 1; NaN where the mass has not come back after 200 contact times, as without contact, and where a damping that is
        far above critical makes the steps unstable. Such a damping's e, next to nothing, comes out too large.

    Example:
        >>> from vibrojax.contact import Newton
        >>> restitution(Newton(restitution=0.8), 1.0, jnp.asarray([0.5])).tolist()
        [0.8]
    """
    if isinstance(law, AbstractInstantaneousLaw):
        return law.rebound_speed(approach_speed) / approach_speed
    assert isinstance(law, AbstractCompliantLaw)
    step = law.contact_time(jnp.asarray(mass), approach_speed) / _RESTITUTION_STEPS

    def rates(_, state):
        indentation, rate = state
        return rate, -law.force(jnp.maximum(indentation, 0.0), rate, approach_speed) / mass

    def onward(state):
        count, indentation, rate, leaving = state
        (deeper, faster), _ = runge_kutta_step(rates, 0.0, (indentation, rate), step)
        leaves = jnp.isnan(leaving) & (deeper <= 0.0)
        part = indentation / jnp.where(leaves, indentation - deeper, 1.0)
        return count + 1, deeper, faster, jnp.where(leaves, rate + part * (faster - rate), leaving)

    def unfinished(state):
        count, _, _, leaving = state
        return (count < _MOST_STEPS) & jnp.any(jnp.isnan(leaving) & jnp.isfinite(step))

    start = (0, jnp.zeros_like(approach_speed), approach_speed, jnp.full_like(approach_speed, jnp.nan))
    *_, leaving = lax.while_loop(unfinished, onward, start)
    found = -leaving / approach_speed
    return jnp.where((found >= 0.0) & (found <= 1.0 + _RESOLVED), jnp.minimum(found, 1.0), jnp.nan)
