"""A second, harder stop behind the one in front, which a deep impact reaches."""

import dataclasses
from typing import ClassVar, TypeGuard

import jax.numpy as jnp
from jax import lax

from vibrojax import smooth
from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw, NoContact
from vibrojax.contact.base import power_law_contact_time
from vibrojax.effects.base import AbstractEffect, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_EXPONENT = 1.5
"""Fixed, as for spheres: few records reach the deep stop, and only some tenths of a millimetre of it, where exponents look alike."""
_DEPTH_GRID = (0.6, 0.8, 0.93)
"""Of the largest indentation."""
_PROBE_DAMPING = 0.3
"""Of the largest speed's inverse."""
_SHORTEST = 0.1
"""Of the time in the first stop, below which that in the deep one does not shorten the steps further."""
_REACHED = 0.5
"""Of the depth; an impact expected to go so far may reach the deep stop."""


class Backed(AbstractCompliantLaw):
    """A contact law with a harder one behind it: F = F_1(delta) + k_d (delta - d)^1.5 (1 + lambda_d delta') beyond d; see `DeepStop`."""

    name: ClassVar[str] = "backed"
    title: ClassVar[str] = "a contact law with a harder stop behind it"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    first: AbstractCompliantLaw
    stiffness: Value
    depth: Value
    damping: Value

    def force(self, indentation: Scalars, rate: Scalars, approach_speed: Scalars) -> Scalars:
        """Of both, N."""
        beyond = self.stiffness * smooth.power(indentation - self.depth, _EXPONENT) * jnp.maximum(1.0 + self.damping * rate, 0.0)
        return self.first.force(indentation, rate, approach_speed) + beyond

    def contact_time(self, mass: Scalars, approach_speed: Scalars) -> Scalars:
        """Of the first stop, s, or the shorter one that the deep stop would take alone where the impact may reach it."""
        first = self.first.contact_time(mass, approach_speed)
        stiffness = jnp.maximum(lax.stop_gradient(jnp.asarray(self.stiffness)), 1e-3)
        deep = power_law_contact_time(stiffness, _EXPONENT, mass, approach_speed)
        reached = approach_speed * first / 3.0 > _REACHED * self.depth
        return jnp.where(reached, jnp.clip(deep, _SHORTEST * first, first), first)


def _candidates(scales: ProbeScales) -> list["DeepStop"]:
    """At several depths that the motion passes, as strong at the deepest as the known stop."""
    if not _gives_way(scales.law) or scales.deepest <= 0 or scales.force == 0 or scales.speed == 0:
        return []
    damping = _PROBE_DAMPING / scales.speed
    depths = [part * scales.deepest for part in _DEPTH_GRID]
    return [DeepStop(scales.force / (scales.deepest - depth) ** _EXPONENT, depth, damping) for depth in depths]


class DeepStop(AbstractEffect):
    """Behind the stop in front, at the depth d in it, there is a harder one, and its push comes on top.

    F_d = k_d (delta - d)^1.5 (1 + lambda_d delta') >= 0 beyond delta = d, none before; what the stop pushes, and its load cell feels, is
    F + F_d. A rubber band that bottoms out, or a buffer pressed flat. A stop behind the hammer (`BackStop`) is of the same law, backed too.
    Differentiable, but on the line 1 + lambda_d delta' = 0. Without contact, or beside a rigid stop, it does nothing.

    Arguments:
        stiffness: k_d >= 0, N/m^1.5.
        depth: d > 0, m, of the nominal stop's indentation.
        damping: lambda_d >= 0, s/m.

    Source: S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155, with the force of
    K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, beyond the break.
    """

    name: ClassVar[str] = "deep_stop"
    summary: ClassVar[str] = "a harder stop behind the first, which deep impacts reach"
    equation: ClassVar[str] = "F -> F + k_d (delta - d)^1.5 (1 + lambda_d delta')  beyond delta = d"
    source: ClassVar[str] = "Shaw and Holmes 1983, Hunt and Crossley 1975"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="deep_stiffness",
            field="stiffness",
            symbol="k_d",
            unit="N/m^1.5",
            start=1e6,
            lower=1.0,
            upper=1e13,
            meaning="stiffness of the stop behind",
        ),
        Parameter(name="depth", field="depth", symbol="d", unit="m", start=1e-3, lower=1e-7, upper=10.0, meaning="depth where it begins"),
        Parameter(
            name="deep_damping",
            field="damping",
            symbol="λ_d",
            unit="s/m",
            start=0.3,
            lower=1e-6,
            upper=1e3,
            meaning="damping factor of the stop behind",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates)

    stiffness: Value
    depth: Value
    damping: Value

    def scaled(self, factor: Value) -> "DeepStop":
        """Stiffness in proportion, at the same depth."""
        return dataclasses.replace(self, stiffness=factor * self.stiffness)

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        """The stop in front, backed."""
        if not _gives_way(law):
            return law, gap
        return Backed(law, self.stiffness, self.depth, self.damping), gap


def _gives_way(law: AbstractContactLaw) -> TypeGuard[AbstractCompliantLaw]:
    """Whether there is a stop at all, into which a hammer gets."""
    return isinstance(law, AbstractCompliantLaw) and not isinstance(law, NoContact)
