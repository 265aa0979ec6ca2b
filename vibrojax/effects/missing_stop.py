"""A stop where the nominal model has none."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from vibrojax.contact import AbstractContactLaw, HuntCrossley, NoContact
from vibrojax.contact.base import IMPACT_DAMPING, IMPACT_EXPONENT, IMPACT_STIFFNESS
from vibrojax.effects.base import AbstractEffect, OwnState
from vibrojax.effects.probe import Probe, ProbeScales
from vibrojax.parameters import Parameter
from vibrojax.shapes import Value

_OUT_OF_REACH = 1e3
"""m"""
_DEPTHS = (0.04, 0.1, 0.25)
"""Deepest indentation of candidates, of the largest deflection."""
_PROBE_EXPONENT = 1.5
_PROBE_DAMPING = 0.3
_JUST_REACHED = 0.98
"""Of the largest deflection, where a candidate stands if no gap was stated that the hammer reaches."""


def _candidates(scales: ProbeScales) -> list["MissingStop"]:
    """Stops of several stiffnesses, for a nominal model without contact only.

    Where every gap is out of reach, which is how a file says that there is no stop, they stand where the hammer just gets to.
    """
    if not isinstance(scales.law, NoContact) or scales.speed == 0 or scales.amplitude == 0:
        return []
    gaps, order = set(scales.gaps.values()), _PROBE_EXPONENT + 1.0
    offset = _JUST_REACHED * scales.amplitude - min(gaps) if len(gaps) == 1 and min(gaps) > scales.amplitude else 0.0
    stiffnesses = (0.5 * order * scales.mass * scales.speed**2 / (part * scales.amplitude) ** order for part in _DEPTHS)
    return [MissingStop(stiffness, _PROBE_EXPONENT, _PROBE_DAMPING, offset) for stiffness in stiffnesses]


class MissingStop(AbstractEffect):
    """A stop at the gap of the record, for a nominal model that knows no contact.

    F = k_i delta^n (1 + lambda_i delta') >= 0 with delta = u - gap - offset; see `HuntCrossley`. Beside any other law it does nothing.

    Arguments:
        impact_stiffness: k_i > 0, N/m^n.
        impact_exponent: n > 0, 1.
        impact_damping: lambda_i >= 0, s/m.
        gap_offset: of the stop beyond the gap as set, m.

    Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975)
    440-445.
    """

    name: ClassVar[str] = "missing_stop"
    summary: ClassVar[str] = "impacts on a stop that the nominal model lacks"
    equation: ClassVar[str] = "F = k_i delta^n (1 + lambda_i delta'),  delta = u - u_stop,  u_stop = gap + gap_0"
    source: ClassVar[str] = "Hunt and Crossley 1975"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        IMPACT_STIFFNESS,
        IMPACT_EXPONENT,
        IMPACT_DAMPING,
        Parameter(
            name="gap_offset",
            field="gap_offset",
            symbol="gap_0",
            unit="m",
            start=0.0,
            lower=-np.inf,
            scale=1e-4,
            logarithmic=False,
            meaning="place of the stop beyond the gap as set",
            from_gap="u_stop",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(_candidates, is_stop=True)

    impact_stiffness: Value
    impact_exponent: Value
    impact_damping: Value
    gap_offset: Value

    def scaled(self, factor: Value) -> "MissingStop":
        """Stiffness in proportion; out of reach for a factor of zero."""
        there = jnp.asarray(factor) > 0
        return dataclasses.replace(
            self,
            impact_stiffness=jnp.where(there, factor, 1.0) * self.impact_stiffness,
            gap_offset=jnp.where(there, self.gap_offset, _OUT_OF_REACH),
        )

    def stop(self, law: AbstractContactLaw, gap: Value) -> tuple[AbstractContactLaw, Value]:
        """The missing stop, where there is none."""
        if not isinstance(law, NoContact):
            return law, gap
        return HuntCrossley(self.impact_stiffness, self.impact_exponent, self.impact_damping), gap + self.gap_offset
