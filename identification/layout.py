"""Which numbers a fit estimates, and where each of them stands in a window's own vector."""

import dataclasses

import numpy as np

from identification.experiment import Record
from vibrojax.parameters import Parameter

NUISANCES = ("base_amplitude", "base_phase", "gap_error")
"""Per record: A0 in m, phase in rad, setting error of the gap in m."""
STATES = ("initial_displacement", "initial_velocity")
"""Per window: u in m and u' in m/s at its first sample."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Layout:
    """Order of a window's vector: shared parameters (internal coordinates), the record's nuisances, the window's initial state."""

    parameters: tuple[Parameter, ...]

    @property
    def shared(self) -> int:
        """Count of shared parameters."""
        return len(self.parameters)

    @property
    def size(self) -> int:
        """Length of a window's vector."""
        return self.shared + len(NUISANCES) + len(STATES)

    def index(self, name: str) -> int:
        """Position of a shared parameter."""
        return [p.name for p in self.parameters].index(name)

    def physical(self, internal: np.ndarray) -> dict[str, float]:
        """Shared parameters by name, SI."""
        return {p.name: p.to_physical(value) for p, value in zip(self.parameters, internal, strict=True)}

    def internal(self, values: dict[str, float]) -> np.ndarray:
        """Coordinates of the fit from values by name, SI."""
        return np.array([p.to_internal(values[p.name]) for p in self.parameters])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Estimate:
    """A point of the fit: shared parameters, nuisances of every record, initial state of every window."""

    shared: np.ndarray
    """(parameters,), internal coordinates."""
    nuisances: np.ndarray
    """(records, 3)"""
    states: np.ndarray
    """(windows, 2)"""

    def local(self, record: np.ndarray) -> np.ndarray:
        """Vector of every window, (windows, size)."""
        count = len(record)
        return np.concatenate([np.broadcast_to(self.shared, (count, len(self.shared))), self.nuisances[record], self.states], axis=1)

    def moved(self, shared: np.ndarray, nuisances: np.ndarray, states: np.ndarray) -> "Estimate":
        """This point plus a step."""
        return Estimate(shared=self.shared + shared, nuisances=self.nuisances + nuisances, states=self.states + states)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Active:
    """Which of the numbers a stage of the fit may move."""

    shared: np.ndarray
    """(parameters,) bool"""
    nuisances: np.ndarray
    """(records, 3) bool"""


def free_nuisances(records: list[Record], *, any_contact: np.ndarray) -> np.ndarray:
    """(records, 3) bool: the sine of a driven cart, and the gap error where the hammer touches the stop at all."""
    driven = np.array([record.kind == "cart-excitation" and record.base == "sine" for record in records])
    return np.stack([driven, driven, any_contact], axis=1)
