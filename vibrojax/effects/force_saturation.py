"""A spring or an actuator whose force is limited."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp

from vibrojax.effects.base import AbstractEffect, Motion, Own, OwnState
from vibrojax.effects.probe import Probe
from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars, Value

_THRESHOLD_GRID = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Of the largest deflection."""


class ForceSaturation(AbstractEffect):
    """A spring beside the linear one whose force stops growing at a threshold, on either side, and comes back the way it went.

    force = -F_s u / u_s up to |u| = u_s, and -F_s sign(u) beyond.

    Together with the linear spring the suspension has the stiffness k + F_s / u_s inside the threshold and k outside: a spring that
    yields without memory, or an actuator that stands in for a spring up to its greatest force. Differentiable but at the threshold.

    Arguments:
        saturation_force: F_s >= 0, N.
        threshold: u_s > 0, m.

    Source: S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155, made symmetric
    and softening.
    """

    name: ClassVar[str] = "force_saturation"
    summary: ClassVar[str] = "a spring or actuator whose force saturates"
    equation: ClassVar[str] = "force = -F_s max(-1, min(1, u / u_s))"
    source: ClassVar[str] = "Shaw and Holmes 1983"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="saturation_force",
            field="saturation_force",
            symbol="F_s",
            unit="N",
            start=0.1,
            scale=0.1,
            logarithmic=False,
            meaning="force beyond the threshold",
        ),
        Parameter(
            name="threshold",
            field="threshold",
            symbol="u_s",
            unit="m",
            start=2e-3,
            lower=1e-6,
            upper=10.0,
            meaning="deflection at which the force stops growing",
        ),
    )
    own_states: ClassVar[tuple[OwnState, ...]] = ()
    probe: ClassVar[Probe] = Probe(
        lambda scales: [
            ForceSaturation(0.02 * scales.flight_force, part * scales.amplitude) for part in _THRESHOLD_GRID if scales.amplitude
        ]
    )
    """A fiftieth of the forces in flight, reached at several parts of the largest deflection."""

    saturation_force: Value
    threshold: Value

    def scaled(self, factor: Value) -> "ForceSaturation":
        """Force in proportion, at the same threshold."""
        return dataclasses.replace(self, saturation_force=factor * self.saturation_force)

    def force(self, motion: Motion, own: Own) -> Scalars:
        """Against the displacement, N."""
        return -self.saturation_force * jnp.clip(motion.u / self.threshold, -1.0, 1.0)
