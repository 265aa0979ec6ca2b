"""Forces on the hammer that the nominal model may leave out: friction, drag, springs that are not linear, memory, and a second mode."""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import parameter
from vibrojax.shapes import Scalars, Value

_CREEP = 5e-4
"""m/s; v_c, over which a force that switches with the sign of the velocity is spread at rest: below it, it is viscous."""


class CoulombFriction(AbstractEffect):
    """Friction of constant size against the relative velocity.

    force = -F_c tanh(u' / v_c). Sticking is a creep below v_c.

    Source: C. A. de Coulomb, Theorie des machines simples (1785); smoothed as in E. Pennestri et al., Nonlinear Dynamics 83 (2016)
    1785-1801.
    """

    name: ClassVar[str] = "coulomb_friction"
    summary: ClassVar[str] = "dry friction in the suspension"
    equation: ClassVar[str] = "force = -F_c sign(u')"
    source: ClassVar[str] = "Coulomb 1785"
    probe: ClassVar[Probe] = Probe(lambda scales: [CoulombFriction(0.01 * scales.flight_force)])
    """A hundredth of the forces in flight."""

    friction_force: Value = parameter("F_c", "N", start=0.1, scale=0.1, logarithmic=False, meaning="friction")
    creep_speed: Value = parameter(
        "v_c", "m/s", start=_CREEP, lower=2e-5, upper=1e-2, meaning="speed below which the hammer creeps", default=_CREEP
    )

    @property
    def switch_speed(self) -> Value:
        return self.creep_speed

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -self.friction_force * jnp.tanh(motion.v / self.creep_speed)


class QuadraticDrag(AbstractEffect):
    """Drag against the relative velocity, in proportion to its square.

    force = -c_d u' |u'|. Differentiable everywhere.

    Source: I. Newton, Philosophiae naturalis principia mathematica (1687), book II, section II.
    """

    name: ClassVar[str] = "quadratic_drag"
    summary: ClassVar[str] = "drag that grows with the square of the velocity"
    equation: ClassVar[str] = "force = -c_d u' |u'|"
    source: ClassVar[str] = "Newton 1687"
    probe: ClassVar[Probe] = Probe(lambda scales: [QuadraticDrag(0.01 * scales.flight_force / scales.speed**2)] if scales.speed else [])
    """At the highest speed, a hundredth of the forces in flight."""

    drag_coefficient: Value = parameter("c_d", "N s^2/m^2", start=1.0, logarithmic=False, meaning="drag coefficient")

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -self.drag_coefficient * motion.v * jnp.abs(motion.v)


_EXPONENT_GRID = (0.5, 1.5, 2.5, 3.0)
"""Of candidates; 0 is dry friction, 1 the nominal damping, 2 the quadratic drag."""


def _power_laws(scales: ProbeScales) -> list["PowerLawDamping"]:
    """Several exponents; at the highest speed, a hundredth of the forces in flight."""
    if scales.speed == 0:
        return []
    return [PowerLawDamping(0.01 * scales.flight_force / scales.speed**exponent, exponent) for exponent in _EXPONENT_GRID]


class PowerLawDamping(AbstractEffect):
    """Loss against the relative velocity, in proportion to a power of it: of a seal, a film of grease, a fluid damper.

    force = -d u' (u'^2 + v_c^2)^((p - 1)/2) with v_c = 0.5 mm/s, which is -d |u'|^p sign(u') well above v_c. At rest a loss with p < 1
    would be infinitely steep. Differentiable everywhere.

    Source: M. C. Constantinou, M. D. Symans, Experimental study of seismic response of buildings with supplemental fluid dampers, The
    Structural Design of Tall Buildings 2 (1993) 93-132; smoothed by us.
    """

    name: ClassVar[str] = "power_law_damping"
    summary: ClassVar[str] = "a loss that grows with a power of the velocity"
    equation: ClassVar[str] = "force = -d |u'|^p sign(u')"
    source: ClassVar[str] = "Constantinou and Symans 1993"
    probe: ClassVar[Probe] = Probe(_power_laws)
    special_cases: ClassVar[tuple[str, ...]] = ("quadratic_drag", "coulomb_friction")
    """p = 2, and p near 0."""

    power_coefficient: Value = parameter("d_p", "N (s/m)^p", start=0.1, logarithmic=False, meaning="force at 1 m/s")
    exponent: Value = parameter("p", "1", start=1.5, lower=0.05, upper=6.0, meaning="power of the velocity")

    @property
    def switch_speed(self) -> Value:
        """v_c for an exponent below one, m/s; infinite above, where the force has no switch."""
        return jnp.where(jnp.asarray(self.exponent) < 1.0, _CREEP, jnp.inf)

    def force(self, motion: Motion, own: Own) -> Scalars:
        speed_squared = motion.v * motion.v + _CREEP**2
        return -self.power_coefficient * motion.v * speed_squared ** (0.5 * (self.exponent - 1.0))


class AsymmetricDamping(AbstractEffect):
    """Viscous damping with one coefficient towards the stop and another away from it, as in a shock absorber.

    force = -D_c |u'| / 2, where D_c is the coefficient towards the stop less that away from it. The nominal damping is their mean.

    Source: J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 3 (damper asymmetry).
    """

    name: ClassVar[str] = "asymmetric_damping"
    summary: ClassVar[str] = "a viscous damping that differs between the two directions"
    equation: ClassVar[str] = "force = -D_c |u'| / 2"
    source: ClassVar[str] = "Dixon 2007"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [AsymmetricDamping(0.02 * scales.flight_force / scales.speed)] if scales.speed else [], either_sign=True
    )
    """At the highest speed, a hundredth of the forces in flight."""

    damping_difference: Value = parameter(
        "D_c", "N s/m", start=0.1, lower=-np.inf, scale=0.1, meaning="damping towards the stop less damping away from it"
    )

    @property
    def damping_needed(self) -> Value:
        """The mean of both directions: neither coefficient of a passive damper is below zero."""
        return 0.5 * jnp.abs(self.damping_difference)

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -0.5 * self.damping_difference * jnp.abs(motion.v)


class CubicStiffness(AbstractEffect):
    """Restoring force with the cube of the relative displacement, beside that of the linear spring.

    force = -k_3 u^3. Differentiable everywhere. k_3 above zero hardens, below it softens.

    Source: G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918).
    """

    name: ClassVar[str] = "cubic_stiffness"
    summary: ClassVar[str] = "a hardening or softening suspension"
    equation: ClassVar[str] = "force = -k_3 u^3"
    source: ClassVar[str] = "Duffing 1918"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [CubicStiffness(0.01 * scales.flight_force / scales.deflection**3)] if scales.deflection else [], either_sign=True
    )
    """At the largest deflection, a hundredth of the forces in flight."""

    cubic_stiffness: Value = parameter("k_3", "N/m^3", start=1e5, lower=-np.inf, scale=1e5, meaning="cubic stiffness")

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -self.cubic_stiffness * motion.u * motion.u * motion.u


class QuinticStiffness(AbstractEffect):
    """Restoring force with the fifth power of the relative displacement, beside that of the linear spring and of a cubic one, if any.

    force = -k_5 u^5. Differentiable everywhere. k_5 above zero hardens, below it softens.

    Source: I. Kovacic, M. J. Brennan (editors), The Duffing Equation: Nonlinear Oscillators and their Behaviour (2011), the next odd term
    of the series.
    """

    name: ClassVar[str] = "quintic_stiffness"
    summary: ClassVar[str] = "a suspension that hardens or softens with the fifth power of the deflection"
    equation: ClassVar[str] = "force = -k_5 u^5"
    source: ClassVar[str] = "Kovacic and Brennan 2011"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [QuinticStiffness(0.01 * scales.flight_force / scales.deflection**5)] if scales.deflection else [], either_sign=True
    )
    """At the largest deflection, a hundredth of the forces in flight."""

    quintic_stiffness: Value = parameter("k_5", "N/m^5", start=1e9, lower=-np.inf, scale=1e9, meaning="quintic stiffness")

    def force(self, motion: Motion, own: Own) -> Scalars:
        square = motion.u * motion.u
        return -self.quintic_stiffness * square * square * motion.u


_THRESHOLD_GRID = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Of the largest deflection, where a candidate saturates or yields."""


class ForceSaturation(AbstractEffect):
    """A spring beside the linear one whose force stops growing at a threshold, on either side, and comes back the way it went.

    force = -F_s u / u_s up to |u| = u_s, and -F_s sign(u) beyond.

    Together with the linear spring the suspension has the stiffness k + F_s / u_s inside the threshold and k outside: a spring that
    yields without memory, or an actuator that stands in for a spring up to its greatest force. Differentiable but at the threshold.

    Source: S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155, made symmetric
    and softening.
    """

    name: ClassVar[str] = "force_saturation"
    summary: ClassVar[str] = "a spring or actuator whose force saturates"
    equation: ClassVar[str] = "force = -F_s max(-1, min(1, u / u_s))"
    source: ClassVar[str] = "Shaw and Holmes 1983"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [
            ForceSaturation(0.02 * scales.flight_force, part * scales.deflection) for part in _THRESHOLD_GRID if scales.deflection
        ]
    )
    """A fiftieth of the forces in flight, reached at several parts of the largest deflection."""

    saturation_force: Value = parameter("F_s", "N", start=0.1, scale=0.1, logarithmic=False, meaning="force beyond the threshold")
    threshold: Value = parameter("u_s", "m", start=2e-3, lower=1e-6, upper=10.0, meaning="deflection at which the force stops growing")

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -self.saturation_force * jnp.clip(motion.u / self.threshold, -1.0, 1.0)


class ConstantForce(AbstractEffect):
    """A force on the hammer that never changes: a rig that stands askew, or a spring that is tight.

    force = F_0. Differentiable everywhere. F_0 above zero pushes towards the stop.

    Source: statics; on a rig tilted by the angle a, F_0 = m g sin(a).
    """

    name: ClassVar[str] = "constant_force"
    summary: ClassVar[str] = "a constant force on the hammer (tilt or preload)"
    equation: ClassVar[str] = "force = F_0"
    source: ClassVar[str] = "statics"
    probe: ClassVar[Probe] = Probe(lambda scales: [ConstantForce(0.01 * scales.flight_force)], either_sign=True)
    """A hundredth of the forces in flight."""

    constant_force: Value = parameter("F_0", "N", start=0.1, lower=-np.inf, scale=0.1, meaning="constant force")

    def force(self, motion: Motion, own: Own) -> Scalars:
        return self.constant_force + jnp.zeros_like(motion.u)


class Hysteresis(AbstractEffect):
    """Bouc-Wen memory that does not depend on the rate: elastic after every reversal, then sliding at a constant force.

    force = -F_h z,   d z' = u' - |u'| z / 2 - u' |z| / 2.

    z lies between -1 and 1; a reversal is followed by a straight line of slope F_h / d. That is Wen's law with A = 1/d,
    beta = gamma = 1/(2 d) and exponent 1. Differentiable everywhere.

    Source: Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249-263, equation 2.
    """

    name: ClassVar[str] = "hysteresis"
    summary: ClassVar[str] = "memory in the suspension (Bouc-Wen hysteresis)"
    equation: ClassVar[str] = "force = -F_h z,  d z' = u' - |u'| z/2 - u' |z|/2"
    source: ClassVar[str] = "Wen 1976"
    own_states: ClassVar[tuple[OwnState, ...]] = (OwnState(name="memory", unit="1", scale=0.5),)
    probe: ClassVar[Probe] = Probe(
        lambda scales: [Hysteresis(0.02 * scales.flight_force, part * scales.deflection) for part in _THRESHOLD_GRID if scales.deflection]
    )
    """A fiftieth of the forces in flight, yielding at several parts of the largest deflection."""

    hysteresis_force: Value = parameter("F_h", "N", start=0.1, scale=0.1, logarithmic=False, meaning="force when sliding")
    yield_displacement: Value = parameter("d", "m", start=2e-3, lower=1e-6, upper=10.0, meaning="way from rest to sliding")

    def force(self, motion: Motion, own: Own) -> Scalars:
        return -self.hysteresis_force * own[..., 0]

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        z, v = own[..., 0], motion.v
        return ((v - 0.5 * jnp.abs(v) * z - 0.5 * v * jnp.abs(z)) / self.yield_displacement)[..., None]


_HIGHEST_MODE, _MODE_RATIO = 100.0, 1.1
"""Highest frequency of candidates over f_n, and from one candidate's frequency to the next."""
_MODE_MASS, _MODE_DAMPING = 0.05, 0.03
"""Of a candidate, the mass relative to the hammer's."""


def _second_modes(scales: ProbeScales) -> list["SecondMode"]:
    """A twentieth of the hammer's mass, at several frequencies that the records can show."""
    highest = _HIGHEST_MODE * scales.f_n if scales.f_n > 0 else math.inf
    return [SecondMode(_MODE_MASS * scales.mass, f, _MODE_DAMPING) for f in scales.frequencies(_MODE_RATIO, highest)]


class SecondMode(AbstractEffect):
    """A mass that hangs on the hammer by a spring and a damper: a second mode of the hammer or its suspension.

    m_2 (w'' + x'') = -(k_2 w + c_2 w'),   force = k_2 w + c_2 w',   k_2 = m_2 (2 pi f_2)^2,   c_2 = 2 zeta_2 m_2 2 pi f_2,

    w its displacement relative to the hammer. The hammer keeps its own mass beside it. Differentiable everywhere.

    Source: J. Ormondroyd, J. P. Den Hartog, The theory of the dynamic vibration absorber, Trans. ASME 50 (1928) APM-50-7.
    """

    name: ClassVar[str] = "second_mode"
    summary: ClassVar[str] = "a second vibrating mode on the hammer or its suspension"
    equation: ClassVar[str] = "m_2 (w'' + x'') = -(k_2 w + c_2 w'),  force = k_2 w + c_2 w'"
    source: ClassVar[str] = "Ormondroyd and Den Hartog 1928"
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="mode_displacement", unit="m", scale=1e-3),
        OwnState(name="mode_velocity", unit="m/s", scale=0.05),
    )
    probe: ClassVar[Probe] = Probe(_second_modes)

    mode_mass: Value = parameter("m_2", "kg", start=0.05, lower=1e-9, upper=1e6, meaning="mass of the mode")
    mode_frequency_hz: Value = parameter("f_2", "Hz", start=30.0, lower=0.1, upper=1e6, meaning="natural frequency of the mode")
    mode_damping_ratio: Value = parameter("ζ_2", "1", start=0.03, lower=1e-5, upper=2.0, meaning="damping ratio of the mode")

    @property
    def fastest_hz(self) -> Value:
        return self.mode_frequency_hz

    def force(self, motion: Motion, own: Own) -> Scalars:
        return self.mode_mass * self._restoring(own)

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        return jnp.stack([own[..., 1], -acceleration - self._restoring(own)], axis=-1)

    def _restoring(self, own: Own) -> Scalars:
        """Force of spring and damper per mass, m/s^2."""
        omega = 2.0 * jnp.pi * self.mode_frequency_hz
        return omega**2 * own[..., 0] + 2.0 * self.mode_damping_ratio * omega * own[..., 1]
