"""What the nominal model may leave out of the stop: its own motion, adhesion, other stops, and a gap that changes."""

import dataclasses
import itertools
import math
from typing import ClassVar, TypeGuard

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax

from vibrojax import smooth
from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw, AbstractInstantaneousLaw, HuntCrossley, NoContact
from vibrojax.contact.base import IMPACT_DAMPING, IMPACT_EXPONENT, IMPACT_STIFFNESS, SLOWEST_APPROACH, power_law_contact_time
from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState, Readings
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import parameter
from vibrojax.shapes import Scalars, Value

_CYCLES_GRID = tuple(float(cycles) for cycles in np.geomspace(0.4, 8.0, 13))
"""Of candidates' stops in the course of a contact."""
_STIFFER = 10.0
"""Stiffness of a candidate under the stop, relative to that of the contact at its deepest."""
_COMPLIANCE_DAMPING = 0.05
_RIGID = 1e15
"""N/m; as if the stop stood fast, and its load cell read the force of the contact."""


def _compliances(scales: ProbeScales) -> list["StopCompliance"]:
    """A stop ten times as stiff as the contact at its deepest, at several frequencies."""
    if math.isnan(scales.contact_time):
        return []
    stiffness = _STIFFER * scales.force / (scales.speed * scales.contact_time / 3.0)
    frequencies = (cycles / scales.contact_time for cycles in _CYCLES_GRID)
    return [StopCompliance(stiffness, f, _COMPLIANCE_DAMPING) for f in frequencies if f * scales.sampling < 1.0]


class StopCompliance(AbstractEffect):
    """The stop, or the load cell that carries it, is compliant and has a resonance of its own.

    m_s s'' = max(F, 0) - k_s s - c_s s',   gap + s instead of gap,   the load cell reads k_s s + c_s s'.

    s is relative to the cart, whose acceleration does not count against that of the stop; m_s = k_s / (2 pi f_s)^2 and
    c_s = 2 zeta_s k_s / (2 pi f_s). What the load cell reads is the force behind the stop: it rings on after separation, below zero too.
    Differentiable everywhere.

    Source: J. P. Den Hartog, Mechanical Vibrations (1934), chapter 2, a mass on a spring; as the front end of a load cell.
    """

    name: ClassVar[str] = "stop_compliance"
    summary: ClassVar[str] = "a compliant stop or load cell with a resonance"
    equation: ClassVar[str] = "m_s s'' = max(F, 0) - k_s s - c_s s',  gap -> gap + s,  load cell = k_s s + c_s s'"
    source: ClassVar[str] = "Den Hartog 1934"
    own_states: ClassVar[tuple[OwnState, ...]] = (
        OwnState(name="stop_displacement", unit="m", scale=1e-4),
        OwnState(name="stop_velocity", unit="m/s", scale=0.3),
    )
    probe: ClassVar[Probe] = Probe(_compliances)

    stop_stiffness: Value = parameter("k_s", "N/m", start=1e6, lower=1e2, upper=1e12, meaning="stiffness")
    stop_frequency_hz: Value = parameter("f_s", "Hz", start=500.0, lower=0.1, upper=1e6, meaning="natural frequency of the stop by itself")
    stop_damping_ratio: Value = parameter("ζ_s", "1", start=0.05, lower=1e-5, upper=2.0, meaning="damping ratio of the stop")

    def scaled(self, factor: Value) -> "StopCompliance":
        """Compliance in proportion, at the same frequency and damping ratio: the stop's mass falls with the factor's inverse."""
        gives_way = jnp.asarray(factor) > 0
        stiffness = jnp.where(gives_way, self.stop_stiffness / jnp.where(gives_way, factor, 1.0), _RIGID)
        return dataclasses.replace(self, stop_stiffness=stiffness)

    @property
    def fastest_hz(self) -> Value:
        return self.stop_frequency_hz

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        return own[..., 0]

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        return own[..., 1]

    def rates(self, motion: Motion, own: Own, push: Scalars, acceleration: Scalars) -> Own:
        """s' and s''; only a push of the stop in front moves it."""
        s, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.stop_frequency_hz
        pushed = omega**2 / self.stop_stiffness * jnp.maximum(push, 0.0)
        return jnp.stack([v, pushed - omega**2 * s - 2.0 * self.stop_damping_ratio * omega * v], axis=-1)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        """The force behind the stop in the load cell, N."""
        if "impact_force" not in readings:
            return readings
        s, v = own[..., 0], own[..., 1]
        omega = 2.0 * jnp.pi * self.stop_frequency_hz
        behind = self.stop_stiffness * (s + 2.0 * self.stop_damping_ratio / omega * v)
        force = readings["impact_force"]
        return readings | {"impact_force": jnp.where(jnp.asarray(self.stop_stiffness) < _RIGID, behind, force)}


_REACH_GRID = (0.01, 0.02, 0.04, 0.08)
"""Of the largest deflection."""
_EDGE = 0.1
"""Depth below the surface, relative to the reach, over which the pull sets in while the hammer leaves."""
_TURN = 5e-4
"""m/s; the pull appears over this change of speed where the hammer turns."""


class ContactAdhesion(AbstractEffect):
    """A pull towards the stop while the hammer leaves it, full at the surface and falling linearly to nothing at the reach.

    force = P,  load cell = F - P,  P = F_ad min(1, 1 + delta / d_ad) for -d_ad < delta < 0 and delta' < 0, else 0.

    P sets in smoothly over 0 < delta < d_ad / 10, that is just before the release, and over 0.5 mm/s where the hammer turns. It has no
    memory: it acts on any motion away from the stop inside the reach. Differentiable; at delta = -d_ad once.

    Source: a cohesive zone that softens linearly, A. Hillerborg, M. Modeer, P.-E. Petersson, Cement and Concrete Research 6 (1976) 773-781;
    acting on separation alone, as adhesion with hysteresis does (K. L. Johnson, Contact Mechanics (1985), section 5.5).
    """

    name: ClassVar[str] = "contact_adhesion"
    summary: ClassVar[str] = "a stop that holds the hammer back while it leaves"
    equation: ClassVar[str] = "force = P,  load cell = F - P,  P = F_ad min(1, 1 + delta/d_ad) while leaving, -d_ad < delta < 0"
    source: ClassVar[str] = "Hillerborg, Modeer and Petersson 1976"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [ContactAdhesion(0.05 * scales.flight_force, part * scales.amplitude) for part in _REACH_GRID if scales.force]
    )
    """A twentieth of the forces in flight, over several reaches."""

    adhesion_force: Value = parameter("F_ad", "N", start=0.5, scale=0.5, logarithmic=False, meaning="largest pull")
    adhesion_reach: Value = parameter("d_ad", "m", start=4e-4, lower=1e-6, upper=1.0, meaning="reach")

    def force(self, motion: Motion, own: Own) -> Scalars:
        depth = motion.indentation / self.adhesion_reach
        falling = jnp.clip(1.0 + depth, 0.0, 1.0) * smooth.step(0.5 * _EDGE - depth, _EDGE)
        return self.adhesion_force * falling * smooth.step(-motion.indentation_rate, _TURN)

    def read(self, readings: Readings, motion: Motion, own: Own) -> Readings:
        if "impact_force" not in readings:
            return readings
        return readings | {"impact_force": readings["impact_force"] - self.force(motion, own)}


_OUT_OF_REACH = 1e3
"""m"""
_BACK_DEPTHS_M = (3e-5, 6e-5, 1.2e-4, 2.5e-4, 5e-4)
_BACK_SHARE = 0.02
"""How far the hammer goes into candidates: in metres, and as a part of its way to the back."""


def _back_stops(scales: ProbeScales) -> list["BackStop"]:
    """Stops that the hammer just reaches."""
    depths = (*_BACK_DEPTHS_M, -_BACK_SHARE * scales.lowest)
    return [BackStop(-scales.lowest - depth) for depth in depths if depth < -scales.lowest]


class BackStop(AbstractEffect):
    """A stop behind the hammer, of the same law as the one in front.

    contact for -u - gap_b > 0, its push towards the stop in front. The load cell is in front and does not feel it.

    Source: S. W. Shaw, The dynamics of a harmonically excited system having rigid amplitude constraints, J. Appl. Mech. 52 (1985) 453-464,
    with compliant stops.
    """

    name: ClassVar[str] = "back_stop"
    summary: ClassVar[str] = "a second stop behind the hammer"
    equation: ClassVar[str] = "F_b = F(-u - gap_b, -u') towards the stop in front"
    source: ClassVar[str] = "Shaw 1985"
    probe: ClassVar[Probe] = Probe(_back_stops, is_stop=True)

    distance: Value = parameter(
        "gap_b", "m", name="back_gap", start=5e-3, scale=1e-3, logarithmic=False, meaning="distance of the stop behind"
    )

    def scaled(self, factor: Value) -> "BackStop":
        """There, or out of reach for a factor of zero: a stop has no strength."""
        return dataclasses.replace(self, distance=jnp.where(jnp.asarray(factor) > 0, self.distance, _OUT_OF_REACH))

    @property
    def back_gap(self) -> Value:
        return self.distance


_STOP_DEPTHS = (0.04, 0.1, 0.25)
"""Deepest indentation of candidates, of the largest deflection."""
_STOP_EXPONENT, _STOP_DAMPING = 1.5, 0.3
"""Of candidates for a missing stop, 1 and s/m."""
_JUST_REACHED = 0.98
"""Of the largest deflection, where a candidate stands if no gap was stated that the hammer reaches."""


def _missing_stops(scales: ProbeScales) -> list["MissingStop"]:
    """Stops of several stiffnesses, for a nominal model without contact only.

    Where every gap is out of reach, which is how a file says that there is no stop, they stand where the hammer just gets to.
    """
    if not isinstance(scales.law, NoContact) or scales.speed == 0 or scales.amplitude == 0:
        return []
    gaps, order = set(scales.gaps.values()), _STOP_EXPONENT + 1.0
    offset = _JUST_REACHED * scales.amplitude - min(gaps) if len(gaps) == 1 and min(gaps) > scales.amplitude else 0.0
    stiffnesses = (0.5 * order * scales.mass * scales.speed**2 / (part * scales.amplitude) ** order for part in _STOP_DEPTHS)
    return [MissingStop(stiffness, _STOP_EXPONENT, _STOP_DAMPING, offset) for stiffness in stiffnesses]


class MissingStop(AbstractEffect):
    """A stop at the gap of the record, for a nominal model that knows no contact.

    F = k_i delta^n (1 + lambda_i delta') >= 0 with delta = u - gap - offset; see `HuntCrossley`. Beside any other law it does nothing.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445.
    """

    name: ClassVar[str] = "missing_stop"
    summary: ClassVar[str] = "impacts on a stop that the nominal model lacks"
    equation: ClassVar[str] = "F = k_i delta^n (1 + lambda_i delta'),  delta = u - u_stop,  u_stop = gap + gap_0"
    source: ClassVar[str] = "Hunt and Crossley 1975"
    probe: ClassVar[Probe] = Probe(_missing_stops, is_stop=True)

    impact_stiffness: Value = IMPACT_STIFFNESS.as_field()
    impact_exponent: Value = IMPACT_EXPONENT.as_field()
    impact_damping: Value = IMPACT_DAMPING.as_field()
    gap_offset: Value = parameter(
        "gap_0", "m", start=0.0, lower=-np.inf, scale=1e-4, meaning="place of the stop beyond the gap as set", from_gap="u_stop"
    )

    def scaled(self, factor: Value) -> "MissingStop":
        """Stiffness in proportion; out of reach for a factor of zero."""
        there = jnp.asarray(factor) > 0
        return dataclasses.replace(
            self,
            impact_stiffness=jnp.where(there, factor, 1.0) * self.impact_stiffness,
            gap_offset=jnp.where(there, self.gap_offset, _OUT_OF_REACH),
        )

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        if not isinstance(law, NoContact):
            return law, gap
        return HuntCrossley(self.impact_stiffness, self.impact_exponent, self.impact_damping), gap + self.gap_offset


_DEEP_EXPONENT = 1.5
"""Fixed, as for spheres: few records reach the deep stop, and only some tenths of a millimetre of it, where exponents look alike."""
_DEEP_DEPTHS = (0.6, 0.8, 0.93)
"""Of the largest indentation."""
_DEEP_DAMPING = 0.3
"""Of the largest speed's inverse."""
_SHORTEST_DEEP = 0.1
"""Of the time in the first stop, below which that in the deep one does not shorten the steps further."""
_REACHED = 0.5
"""Of the depth; an impact expected to go so far may reach the deep stop."""


class Backed(AbstractCompliantLaw):
    """A contact law with a harder one behind it: F = F_1(delta) + k_d (delta - d)^1.5 (1 + lambda_d delta') beyond d; see `DeepStop`."""

    name: ClassVar[str] = "backed"
    title: ClassVar[str] = "a contact law with a harder stop behind it"

    first: AbstractCompliantLaw
    stiffness: Value
    depth: Value
    damping: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        beyond = self.stiffness * smooth.power(indentation - self.depth, _DEEP_EXPONENT) * jnp.maximum(1.0 + self.damping * rate, 0.0)
        return self.first.force(indentation, rate, approach_speed) + beyond

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Of the first stop, s, or the shorter one that the deep stop would take alone where the impact may reach it."""
        first = self.first.contact_time(mass, approach_speed)
        stiffness = jnp.maximum(lax.stop_gradient(jnp.asarray(self.stiffness)), 1e-3)
        deep = power_law_contact_time(stiffness, _DEEP_EXPONENT, mass, approach_speed)
        reached = approach_speed * first / 3.0 > _REACHED * self.depth
        return jnp.where(reached, jnp.clip(deep, _SHORTEST_DEEP * first, first), first)


def _deep_stops(scales: ProbeScales) -> list["DeepStop"]:
    """At several depths that the motion passes, as strong at the deepest as the known stop."""
    if not _gives_way(scales.law) or scales.deepest <= 0 or scales.force == 0 or scales.speed == 0:
        return []
    damping = _DEEP_DAMPING / scales.speed
    depths = [part * scales.deepest for part in _DEEP_DEPTHS]
    return [DeepStop(scales.force / (scales.deepest - depth) ** _DEEP_EXPONENT, depth, damping) for depth in depths]


class DeepStop(AbstractEffect):
    """Behind the stop in front, at the depth d in it, there is a harder one, and its push comes on top.

    F_d = k_d (delta - d)^1.5 (1 + lambda_d delta') >= 0 beyond delta = d, none before; what the stop pushes, and its load cell feels, is
    F + F_d. A rubber band that bottoms out, or a buffer pressed flat. A stop behind the hammer (`BackStop`) is of the same law, backed too.
    Differentiable, but on the line 1 + lambda_d delta' = 0. Without contact, or beside a rigid stop, it does nothing.

    Source: S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155, with the force of
    K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, beyond the break.
    """

    name: ClassVar[str] = "deep_stop"
    summary: ClassVar[str] = "a harder stop behind the first, which deep impacts reach"
    equation: ClassVar[str] = "F -> F + k_d (delta - d)^1.5 (1 + lambda_d delta')  beyond delta = d"
    source: ClassVar[str] = "Shaw and Holmes 1983, Hunt and Crossley 1975"
    probe: ClassVar[Probe] = Probe(_deep_stops)

    stiffness: Value = parameter(
        "k_d", "N/m^1.5", name="deep_stiffness", start=1e6, lower=1.0, upper=1e13, meaning="stiffness of the stop behind"
    )
    depth: Value = parameter("d", "m", start=1e-3, lower=1e-7, upper=10.0, meaning="depth where it begins")
    damping: Value = parameter(
        "λ_d", "s/m", name="deep_damping", start=0.3, lower=1e-6, upper=1e3, meaning="damping factor of the stop behind"
    )

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        if not _gives_way(law):
            return law, gap
        return Backed(law, self.stiffness, self.depth, self.damping), gap


def _gives_way(law: AbstractContactLaw) -> TypeGuard[AbstractCompliantLaw]:
    """Whether there is a stop at all, into which a hammer gets."""
    return isinstance(law, AbstractCompliantLaw) and not isinstance(law, NoContact)


class SlowedRebound(AbstractInstantaneousLaw):
    """A rigid stop whose restitution falls with the speed: e / (v / v_1)^q, at most 1; see `FallingRestitution`."""

    name: ClassVar[str] = "slowed-rebound"
    title: ClassVar[str] = "a rigid stop whose restitution falls with the speed"

    law: AbstractInstantaneousLaw
    power: Value
    reference_speed: Value

    def rebound_speed(self, approach_speed: Scalars) -> Scalars:
        relative = jnp.maximum(approach_speed, SLOWEST_APPROACH) / self.reference_speed
        return jnp.minimum(self.law.rebound_speed(approach_speed) * jnp.exp(-self.power * jnp.log(relative)), approach_speed)


class FallingRestitution(AbstractEffect):
    """The restitution of a rigid stop falls with the speed of the impact, by a power of it.

    e(v) = e / (v / v_1)^q, at most 1, with e that of the nominal law: the restitution at v_1, half the largest speed of the records. Fully
    plastic indentation gives q = 1/4; with q = 1 the rebound has the same speed after every impact. Slow impacts, below v_1 e^(1/q), lose
    nothing. Differentiable but where e(v) reaches 1. Beside a stop that gives way, whose law says the restitution, it does nothing.

    Source: K. L. Johnson, Contact Mechanics (1985), section 11.5, where q = 1/4; W. Goldsmith, Impact (1960), chapter 7, as measured.
    """

    name: ClassVar[str] = "falling_restitution"
    summary: ClassVar[str] = "a restitution that falls with the speed of the impact"
    equation: ClassVar[str] = "e -> e / (v / v_1)^q"
    source: ClassVar[str] = "Johnson 1985"
    probe: ClassVar[Probe] = Probe(
        lambda scales: (
            [FallingRestitution(0.1, 0.5 * v)] if isinstance(scales.law, AbstractInstantaneousLaw) and (v := scales.speed) else []
        )
    )

    power: Value = parameter("q", "1", start=0.25, upper=1.0, scale=0.1, logarithmic=False, meaning="power by which restitution falls")
    reference_speed: Value = parameter("v_1", "m/s", start=0.1, lower=1e-6, searched=True, meaning="speed at which the restitution is e")

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        return (SlowedRebound(law, self.power, self.reference_speed) if isinstance(law, AbstractInstantaneousLaw) else law), gap


_DRIFT_WAY = 2e-3
"""Of the largest deflection, by the end of the longest record."""


class GapDrift(AbstractEffect):
    """The stop moves away from the hammer, or towards it, at a steady rate from the zero of the clock of every record.

    gap(t) = gap + g t. Differentiable everywhere. g above zero opens the gap.

    Source: kinematics.
    """

    name: ClassVar[str] = "gap_drift"
    summary: ClassVar[str] = "a gap that opens or closes steadily during a record"
    equation: ClassVar[str] = "gap(t) = gap + g t"
    source: ClassVar[str] = "kinematics"
    probe: ClassVar[Probe] = Probe(
        lambda scales: [GapDrift(_DRIFT_WAY * scales.amplitude / scales.latest)] if scales.force and scales.latest else [],
        either_sign=True,
    )
    """By the end of the longest record, a five-hundredth of the largest deflection."""

    gap_rate: Value = parameter("g", "m/s", start=1e-4, lower=-np.inf, scale=1e-4, meaning="rate at which the gap opens")

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        return self.gap_rate * t

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        return self.gap_rate + jnp.zeros_like(t)


_JUMP = 2e-3
"""Of the largest deflection."""
_JUMP_WIDTH = 1e-3
"""s; the jump is spread over it."""


def _gap_steps(scales: ProbeScales) -> list["GapStep"]:
    """One for every flight between two impacts of every record."""
    jump = _JUMP * scales.amplitude
    return [
        GapStep(jump, 0.5 * (left + touched), in_file=file)
        for file, contacts in scales.contacts.items()
        for (_, left), (touched, _) in itertools.pairwise(contacts)
    ]


class GapStep(AbstractEffect):
    """The stop slips, at one instant of one record.

    gap(t) = gap + j H(t - t_s), with H a step spread over 1 ms. Differentiable everywhere; in t_s the derivative is zero unless the hammer
    touches the stop within that millisecond; that width limits how well it is identifiable.

    Source: kinematics.
    """

    name: ClassVar[str] = "gap_step"
    summary: ClassVar[str] = "a gap that changes suddenly at one instant"
    equation: ClassVar[str] = "gap(t) = gap + j H(t - t_s)"
    source: ClassVar[str] = "kinematics"
    probe: ClassVar[Probe] = Probe(_gap_steps, either_sign=True)

    gap_jump: Value = parameter("j", "m", start=1e-4, lower=-np.inf, scale=1e-4, meaning="change of the gap")
    instant: Value = parameter(
        "t_s", "s", start=0.0, lower=-np.inf, searched=True, resolution=_JUMP_WIDTH / np.sqrt(12.0), meaning="time of the change"
    )
    in_file: str = eqx.field(static=True, default="")

    @property
    def record(self) -> str | None:
        return self.in_file or None

    def stop_position(self, t: Scalars, own: Own) -> Scalars:
        return self.gap_jump * smooth.step(t - self.instant, _JUMP_WIDTH)

    def stop_velocity(self, t: Scalars, own: Own) -> Scalars:
        s = jnp.clip((t - self.instant) / _JUMP_WIDTH + 0.5, 0.0, 1.0)
        return self.gap_jump * 30.0 / _JUMP_WIDTH * (s * (1.0 - s)) ** 2
