"""The contact laws: springs of a power of the indentation, linear springs, a rigid stop, and none."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from vibrojax import smooth
from vibrojax.contact.base import (
    IMPACT_DAMPING,
    IMPACT_EXPONENT,
    IMPACT_STIFFNESS,
    LINEAR_DAMPING,
    LINEAR_STIFFNESS,
    RESTITUTION,
    SLOWEST_APPROACH,
    AbstractCompliantLaw,
    AbstractInstantaneousLaw,
    power_law_contact_time,
)
from vibrojax.parameters import parameter
from vibrojax.shapes import Scalars, Value


class AbstractPowerLaw(AbstractCompliantLaw):
    """A law whose elastic force is k_i delta^n."""

    impact_stiffness: eqx.AbstractVar[Value]
    impact_exponent: eqx.AbstractVar[Value]

    def elastic_force(self, indentation: Scalars) -> Scalars:
        """k_i delta^n, N."""
        return self.impact_stiffness * smooth.power(indentation, self.impact_exponent)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Elastic contact time, s."""
        return power_law_contact_time(self.impact_stiffness, self.impact_exponent, mass, approach_speed)


class Hertz(AbstractPowerLaw):
    """Nonlinear spring without damping: what comes in with v0 goes out with v0.

    F = k_i delta^n.

    Deepest indentation ((n+1) m v0^2 / (2 k_i))^(1/(n+1)), reached halfway through a contact of
    2 sqrt(pi) Gamma(1 + 1/(n+1)) / Gamma(1/2 + 1/(n+1)) delta_max / v0.
    Differentiable everywhere; at delta = 0 all derivatives are taken as zero, which is the true slope for n > 1.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.

    Source: H. Hertz, Über die Berührung fester elastischer Körper, J. reine angew. Math. 92 (1882) 156-171, where n = 3/2; the general
    exponent and its contact time are textbook extensions by conservation of energy.

    Example:
        >>> law = Hertz(impact_stiffness=1e6, impact_exponent=1.5)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.1), jnp.asarray(0.1))), 6)
        1.0
    """

    name: ClassVar[str] = "hertz"
    title: ClassVar[str] = "Hertz (1882)"

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        return self.elastic_force(indentation)


class HuntCrossley(AbstractPowerLaw):
    """Nonlinear spring whose damping grows with indentation, so that the force is zero at touch and at release.

    F = k_i delta^n (1 + lambda_i delta'), never negative.

    Restitution e against approach speed v0 obeys a (1 + e) = ln((1 + a) / (1 - a e)), a = lambda_i v0, whatever mass, k_i and n; solved,
    e = (1 + W(-(1 + a) exp(-1 - a))) / a with Lambert's W (principal branch).
    Differentiable everywhere but on the line 1 + lambda_i delta' = 0, where the clipping acts; at delta = 0 all derivatives are taken
    as zero, which is the true slope for n > 1.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        impact_damping: lambda_i >= 0, s/m.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445; their damping force b x^p x'^q with p = n, q = 1 and b = k_i lambda_i, clipped at zero.

    Example:
        >>> law = HuntCrossley(impact_stiffness=2.1e8, impact_exponent=1.6, impact_damping=0.6)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.0), jnp.asarray(0.1))), 1)
        83.6
    """

    name: ClassVar[str] = "hunt-crossley"
    title: ClassVar[str] = "Hunt–Crossley (1975)"

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()
    impact_damping: Value = IMPACT_DAMPING.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        elastic = self.elastic_force(indentation)
        return elastic * jnp.maximum(1.0 + self.impact_damping * rate, 0.0)


class HuntCrossleySeparate(AbstractPowerLaw):
    """Nonlinear spring and a damper that grows with another power of the indentation.

    F = k_i delta^n + k_i lambda_i delta^n2 delta', never negative.

    With n2 = n this is `HuntCrossley`. With n2 != n the restitution depends on mass and stiffness too; for little damping the energy lost
    in one impact is 2 k_i lambda_i v0 delta_max^(n2+1) B((n2+1)/(n+1), 3/2) / (n+1), B the beta function and delta_max the elastic depth.
    With n2 < n the force reaches zero before the indentation does and is clipped there.
    Differentiable everywhere but where the clipping acts; at delta = 0 all derivatives are taken as zero (true for n > 1 and n2 > 1, or
    at a rate of zero).

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1.
        impact_damping: lambda_i >= 0, s m^(n-n2-1).
        damping_exponent: n2 > 0, 1.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445; their damping force b x^p x'^q with p = n2, q = 1 and b = k_i lambda_i, clipped at zero. The lost energy is ours, from the
    elastic velocity v0 sqrt(1 - (delta/delta_max)^(n+1)).

    Example:
        >>> law = HuntCrossleySeparate(impact_stiffness=1e6, impact_exponent=1.5, impact_damping=0.2, damping_exponent=1.0)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.1), jnp.asarray(0.1))), 3)
        3.0
    """

    name: ClassVar[str] = "hunt-crossley-separate"
    title: ClassVar[str] = "Hunt–Crossley (1975), separate exponents"

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()
    impact_damping: Value = parameter(
        "λ_i", "s m^(n-n_2-1)", name="lambda_i", start=0.3, lower=1e-9, upper=1e9, meaning="contact damping factor"
    )
    damping_exponent: Value = parameter(
        "n_2", "1", name="n_2", start=1.5, lower=0.1, upper=4.0, logarithmic=False, meaning="damping exponent"
    )

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        damping = self.impact_damping * smooth.power(indentation, self.damping_exponent) * rate
        return self.impact_stiffness * jnp.maximum(smooth.power(indentation, self.impact_exponent) + damping, 0.0)


def _relative_rate(rate: Scalars, approach_speed: Scalars) -> Scalars:
    """Rate over approach speed, delta' / v0, with an approach slower than `SLOWEST_APPROACH` taken as that."""
    return rate / jnp.maximum(approach_speed, SLOWEST_APPROACH)


class LankaraniNikravesh(AbstractPowerLaw):
    """Hunt–Crossley law whose damping is set from a wanted restitution, assuming that little energy is lost.

    F = k_i delta^n (1 + 3 (1 - e^2) / 4 delta' / v0), never negative.

    The restitution that results is Hunt and Crossley's with a = 3 (1 - e^2) / 4, whatever the speed. It exceeds the wanted e by
    3 (1 - e)^2 / 2 as e -> 1 (0.9 gives 0.913, 0.8 gives 0.847) and never falls below 0.663: 0.5 gives 0.725.
    Differentiable everywhere but where the clipping acts, and at an approach speed of `SLOWEST_APPROACH`, below which v0 is taken as that.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        restitution: e in (0, 1], 1.

    Source: H. M. Lankarani, P. E. Nikravesh, A contact force model with hysteresis damping for impact analysis of multibody systems,
    J. Mech. Des. 112 (1990) 369-376; clipped at zero, and any exponent.

    Example:
        >>> law = LankaraniNikravesh(impact_stiffness=1e6, impact_exponent=1.5, restitution=0.8)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.2), jnp.asarray(0.2))), 6)
        1.27
    """

    name: ClassVar[str] = "lankarani-nikravesh"
    title: ClassVar[str] = "Lankarani–Nikravesh (1990)"

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()
    restitution: Value = RESTITUTION.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        elastic = self.elastic_force(indentation)
        loss = 0.75 * (1.0 - self.restitution**2)
        return elastic * jnp.maximum(1.0 + loss * _relative_rate(rate, approach_speed), 0.0)


class Flores(AbstractPowerLaw):
    """Hunt–Crossley law whose damping is set from a wanted restitution, for soft and hard materials alike.

    F = k_i delta^n (1 + 8 (1 - e) / (5 e) delta' / v0), never negative.

    The restitution that results is Hunt and Crossley's with a = 8 (1 - e) / (5 e), whatever the speed. It is close to the wanted e over
    the whole range, below it by at most 0.046 (at e = 0.24): 0.9 gives 0.894, 0.5 gives 0.470, 0.1 gives 0.069.
    Differentiable everywhere but where the clipping acts, and at an approach speed of `SLOWEST_APPROACH`, below which v0 is taken as that.
    Not defined at e = 0.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1; 1.5 for spheres.
        restitution: e in (0, 1], 1.

    Source: P. Flores, M. Machado, M. T. Silva, J. M. Martins, On the continuous contact force models for soft materials in multibody
    dynamics, Multibody Syst. Dyn. 25 (2011) 357-375; clipped at zero, and any exponent.

    Example:
        >>> law = Flores(impact_stiffness=1e6, impact_exponent=1.5, restitution=0.8)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(0.2), jnp.asarray(0.2))), 6)
        1.4
    """

    name: ClassVar[str] = "flores"
    title: ClassVar[str] = "Flores et al. (2011)"

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()
    restitution: Value = RESTITUTION.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        elastic = self.elastic_force(indentation)
        loss = 1.6 * (1.0 - self.restitution) / self.restitution
        return elastic * jnp.maximum(1.0 + loss * _relative_rate(rate, approach_speed), 0.0)


class AbstractLinearLaw(AbstractCompliantLaw):
    """A law of a linear spring of stiffness k_i."""

    impact_stiffness: eqx.AbstractVar[Value]

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Half a period of the undamped oscillator, s."""
        return jnp.pi * jnp.sqrt(mass / self.impact_stiffness) + jnp.zeros_like(approach_speed)


class KelvinVoigt(AbstractLinearLaw):
    """Linear spring and dashpot while delta > 0; jumps to k_i lambda_i v0 at touch and pulls the hammer back while it leaves.

    F = k_i (delta + lambda_i delta').

    With omega = sqrt(k_i / m) and zeta = lambda_i omega / 2 < 1, contact is one half period pi / (omega sqrt(1 - zeta^2)) of a damped
    oscillator and e = exp(-pi zeta / sqrt(1 - zeta^2)), whatever the speed; with zeta >= 1 the hammer never leaves.
    Linear, hence differentiable everywhere inside contact; the jump at touch is the caller's switch.

    Arguments:
        impact_stiffness: k_i > 0, N/m.
        impact_damping: lambda_i >= 0, s.

    Source: W. Goldsmith, Impact: The Theory and Physical Behaviour of Colliding Solids, Arnold (1960), linear viscoelastic model; the
    dashpot written as k_i lambda_i.

    Example:
        >>> law = KelvinVoigt(impact_stiffness=1e6, impact_damping=1e-3)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(-0.2), jnp.asarray(0.3))), 6)
        -100.0
    """

    name: ClassVar[str] = "kelvin-voigt"
    title: ClassVar[str] = "Kelvin–Voigt"

    impact_stiffness: Value = LINEAR_STIFFNESS.as_field()
    impact_damping: Value = LINEAR_DAMPING.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        return self.impact_stiffness * (indentation + self.impact_damping * rate)


class KelvinVoigtClipped(AbstractLinearLaw):
    """Linear spring and dashpot that lets go as soon as it would pull; still jumps to k_i lambda_i v0 at touch.

    F = k_i max(delta + lambda_i delta', 0).

    With omega = sqrt(k_i / m) and zeta = lambda_i omega / 2 < 1, the force vanishes after (pi - atan2(2 zeta r, 1 - 2 zeta^2)) / (omega r),
    r = sqrt(1 - zeta^2), and e = exp(-zeta (pi - atan2(2 zeta r, 1 - 2 zeta^2)) / r), whatever the speed; with zeta > 1,
    e = exp(-zeta / s ln((zeta + s) / (zeta - s))), s = sqrt(zeta^2 - 1). The rest of the indentation is left without force.
    Differentiable everywhere but on the line delta + lambda_i delta' = 0, where the clipping acts.

    Arguments:
        impact_stiffness: k_i > 0, N/m.
        impact_damping: lambda_i >= 0, s.

    Source: T. Schwager, T. Pöschel, Coefficient of restitution and linear-dashpot model revisited, Granular Matter 9 (2007) 465-469; the
    dashpot written as k_i lambda_i, their two branches of the arctangent as one `atan2`.

    Example:
        >>> law = KelvinVoigtClipped(impact_stiffness=1e6, impact_damping=1e-3)
        >>> round(float(law.force(jnp.asarray(1e-4), jnp.asarray(-0.2), jnp.asarray(0.3))), 6)
        0.0
    """

    name: ClassVar[str] = "kelvin-voigt-clipped"
    title: ClassVar[str] = "Kelvin–Voigt, pushing only"

    impact_stiffness: Value = LINEAR_STIFFNESS.as_field()
    impact_damping: Value = LINEAR_DAMPING.as_field()

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        return self.impact_stiffness * jnp.maximum(indentation + self.impact_damping * rate, 0.0)


class Newton(AbstractInstantaneousLaw):
    """Rigid stop: the velocity jumps at the touch, in no time and without indentation.

    v+ = -e v-; the impulse is m (1 + e) v-, the energy lost m (1 - e^2) v-^2 / 2.

    Linear, hence differentiable everywhere; a trajectory is not at a grazing touch (v- = 0).

    Arguments:
        restitution: e in (0, 1], 1.

    Source: I. Newton, Philosophiae naturalis principia mathematica (1687), scholium after the laws of motion.

    Example:
        >>> round(float(Newton(restitution=0.8).rebound_speed(jnp.asarray(0.5))), 6)
        0.4
    """

    name: ClassVar[str] = "newton"
    title: ClassVar[str] = "Newton's restitution (1687)"

    restitution: Value = RESTITUTION.as_field()

    def rebound_speed(self, approach_speed: Scalars) -> Scalars:
        return self.restitution * approach_speed


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

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        return jnp.zeros_like(indentation)

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Without end, s: it asks for no finer steps."""
        return jnp.full_like(approach_speed, jnp.inf)
