"""What is known of a rig when an effect is drawn for it, so that its strength has a scale."""

import dataclasses
import functools

import numpy as np

from benchmarks.simulator.experiment import RecordPlan, motion, true_signals
from benchmarks.simulator.hidden import Hidden
from benchmarks.simulator.rig import Rig


@dataclasses.dataclass(frozen=True)
class Setting:
    """A rig, the records planned with it, and the channels that are recorded."""

    rig: Rig
    plans: tuple[RecordPlan, ...]
    channels: tuple[str, ...]
    sealed: tuple[RecordPlan, ...] = ()
    """Records of other operating points, in which the effect must be possible too."""

    @property
    def spring_force(self) -> float:
        """k A0: what the suspension does at the drive's amplitude, N."""
        return self.rig.k * self.rig.base_amplitude

    @property
    def speed(self) -> float:
        """A0 omega_n, m/s."""
        return self.rig.base_amplitude * 2.0 * np.pi * self.rig.f_n

    @property
    def driven(self) -> tuple[RecordPlan, ...]:
        """The records with a moving cart."""
        return tuple(plan for plan in self.plans if plan.excitation_frequency > 0.0)

    @functools.cached_property
    def nominal(self) -> tuple[dict[str, np.ndarray], ...]:
        """True signals of the driven records if nothing is concealed."""
        return tuple(true_signals(self.rig, plan) for plan in self.driven)

    @property
    def displacements(self) -> tuple[np.ndarray, ...]:
        """The same records' u = x - y, m."""
        return tuple(signals["hammer_displacement"] - signals["cart_displacement"] for signals in self.nominal)

    def farthest(self, hidden: Hidden) -> float:
        """Largest |x - y| in all motions, also before the records begin, m; infinite where one runs away."""
        farthest = 0.0
        for plan in self.plans + self.sealed:
            try:
                signals = motion(self.rig, plan, hidden)
            except ArithmeticError:
                return np.inf
            farthest = max(farthest, float(np.abs(signals["hammer_displacement"] - signals["cart_displacement"]).max()))
        return farthest

    @property
    def highest_force(self) -> float:
        """Highest force of the stop in any of them, N."""
        return max(float(signals["impact_force"].max()) for signals in self.nominal)

    @property
    def impulse(self) -> float:
        """Largest sum of the stop's impulses in any of them, N s."""
        return max(float(np.trapezoid(signals["impact_force"], signals["time"])) for signals in self.nominal)
