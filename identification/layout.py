"""Which numbers a fit estimates, and where each of them stands in a window's own vector."""

import dataclasses

import numpy as np

from identification.experiment import Record
from vibrojax.effects import OwnState
from vibrojax.model import Model
from vibrojax.parameters import Parameter

NUISANCES = ("base_amplitude", "base_phase", "gap_error")
"""Per record: A0 in m, phase in rad, setting error of the gap in m; behind them the effects' own, if any."""
STATES = ("initial_displacement", "initial_velocity")
"""Per window: u in m and u' in m/s at its first sample; behind them those states of effects that do not begin at rest."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Layout:
    """Order of a window's vector: shared parameters (internal coordinates), the record's nuisances, the window's initial state."""

    parameters: tuple[Parameter, ...]
    record_parameters: tuple[Parameter, ...] = ()
    """Of effects, each record with its own."""
    own_states: tuple[OwnState, ...] = ()
    """Of effects."""
    files: tuple[str, ...] = ()
    """Of the records, in the order of their indices."""

    @property
    def nuisances(self) -> tuple[str, ...]:
        """Names of what each record has of its own."""
        return (*NUISANCES, *(p.name for p in self.record_parameters))

    @property
    def free_own(self) -> tuple[int, ...]:
        """Positions among `own_states` of those that do not begin at rest."""
        return tuple(index for index, state in enumerate(self.own_states) if state.scale > 0)

    @property
    def states(self) -> int:
        """Count of numbers that a window begins with."""
        return len(STATES) + len(self.free_own)

    @property
    def shared(self) -> int:
        """Count of shared parameters."""
        return len(self.parameters)

    @property
    def size(self) -> int:
        """Length of a window's vector."""
        return self.shared + len(self.nuisances) + self.states

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
    """(records, nuisances)"""
    states: np.ndarray
    """(windows, states)"""

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
    """(records, nuisances) bool"""


def layout_of(model: Model, *extra: Parameter, files: tuple[str, ...]) -> Layout:
    """Everything that a model leaves to estimate, and `extra` shared parameters."""
    own_states = tuple(state for effect in model.effects for state in effect.own_states)
    return Layout(parameters=(*model.parameters, *extra), record_parameters=model.record_parameters, own_states=own_states, files=files)


def free_nuisances(records: list[Record], layout: Layout, *, any_contact: np.ndarray) -> np.ndarray:
    """(records, nuisances) bool: the sine of a driven cart, the gap error where the hammer touches the stop at all, all of effects'."""
    driven = np.array([record.kind == "cart-excitation" and record.base == "sine" for record in records])
    of_effects = np.ones((len(records), len(layout.record_parameters)), bool)
    return np.concatenate([np.stack([driven, driven, any_contact], axis=1), of_effects], axis=1)
