"""Which numbers a fit estimates, and where each of them stands in a window's own vector."""

import dataclasses

import numpy as np

from identification.experiment import Record
from identification.windows.measured_input import driving_channels
from vibrojax.effects import OwnState
from vibrojax.model import Model
from vibrojax.parameters import Parameter

NUISANCES = ("base_amplitude", "base_phase", "gap_error")
"""Per record: A0 in m, phase in rad, setting error of the gap in m; behind them sensors' zeros and the effects' own, if any."""
GAP_PRIOR_STD = 1e-3
"""m; wide enough not to be felt where impacts show the gap, narrow enough to hold it where they do not."""
STATES = ("initial_displacement", "initial_velocity")
"""Per window: u in m and u' in m/s at its first sample; behind them those states of effects that do not begin at rest."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Layout:
    """Order of a window's vector: shared parameters (internal coordinates), the record's nuisances, the window's initial state."""

    parameters: tuple[Parameter, ...]
    record_parameters: tuple[Parameter, ...] = ()
    """Of effects, each record with its own."""
    zeros: tuple[tuple[str, float], ...] = ()
    """Channels whose zero is not known, each record with its own, and the standard deviation of that, SI."""
    variations: tuple[tuple[str, float], ...] = ()
    """Shared parameters that vary between records, and the standard deviation of that in their internal coordinates."""
    own_states: tuple[OwnState, ...] = ()
    """Of effects."""
    files: tuple[str, ...] = ()
    """Of the records, in the order of their indices."""

    @property
    def nuisances(self) -> tuple[str, ...]:
        """Names of what each record has of its own."""
        zeros, variations = (f"zero.{channel}" for channel, _ in self.zeros), (f"variation.{name}" for name, _ in self.variations)
        return (*NUISANCES, *zeros, *variations, *(p.name for p in self.record_parameters))

    @property
    def without_effects(self) -> int:
        """Count of what each record has of its own before that of effects."""
        return len(NUISANCES) + len(self.zeros) + len(self.variations)

    @property
    def nuisance_count(self) -> int:
        """Count of what each record has of its own."""
        return self.without_effects + len(self.record_parameters)

    @property
    def varying(self) -> slice:
        """Places of the variations among what each record has of its own."""
        return slice(len(NUISANCES) + len(self.zeros), self.without_effects)

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
    force: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    """(windows, knots): random force, N; empty where it is not estimated."""

    def local(self, record: np.ndarray) -> np.ndarray:
        """Vector of every window, (windows, size)."""
        count = len(record)
        return np.concatenate([np.broadcast_to(self.shared, (count, len(self.shared))), self.nuisances[record], self.states], axis=1)

    def moved(self, shared: np.ndarray, nuisances: np.ndarray, states: np.ndarray) -> "Estimate":
        """This point plus a step."""
        return dataclasses.replace(self, shared=self.shared + shared, nuisances=self.nuisances + nuisances, states=self.states + states)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Active:
    """Which of the numbers a stage of the fit may move."""

    shared: np.ndarray
    """(parameters,) bool"""
    nuisances: np.ndarray
    """(records, nuisances) bool"""


def layout_of(
    model: Model,
    *extra: Parameter,
    files: tuple[str, ...],
    zeros: tuple[tuple[str, float], ...] = (),
    variations: tuple[tuple[str, float], ...] = (),
) -> Layout:
    """Everything that a model leaves to estimate, `extra` shared parameters, zeros of sensors, and variations between records."""
    return Layout(
        parameters=(*model.parameters, *extra),
        record_parameters=model.record_parameters,
        zeros=zeros,
        variations=variations,
        own_states=tuple(state for effect in model.effects for state in effect.own_states),
        files=files,
    )


def free_nuisances(records: list[Record], layout: Layout, *, any_contact: np.ndarray) -> np.ndarray:
    """(records, nuisances) bool: the sine of a driven cart, the gap error where the hammer touches the stop at all, and all of the rest.

    A channel that drives the model is taken as it is, with its zero.
    """
    driven = np.array([record.kind == "cart-excitation" and record.base == "sine" for record in records])
    of_effects = np.ones((len(records), len(layout.record_parameters)), bool)
    compared = [frozenset(record.channels) - driving_channels(record) for record in records]
    zeros = np.array([[channel in those for channel, _ in layout.zeros] for those in compared], bool).reshape(len(records), -1)
    variations = np.ones((len(records), len(layout.variations)), bool)
    return np.concatenate([np.stack([driven, driven, any_contact], axis=1), zeros, variations, of_effects], axis=1)
