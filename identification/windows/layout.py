"""Unknowns of a fit, and their order in each window's vector."""

import dataclasses

import numpy as np

from identification.experiment import Record
from identification.windows.measured_input import driving_channels
from vibrojax.effects import OwnState
from vibrojax.model import Model
from vibrojax.parameters import Parameter

NUISANCES = ("base_amplitude", "base_phase", "gap_error")
"""Per record: A0 in m, phase in rad, setting error of the gap in m; sensor zeros and the effects' parameters per record follow, if any."""
BASE_AMPLITUDE, GAP_ERROR = NUISANCES.index("base_amplitude"), NUISANCES.index("gap_error")
"""Columns of these among the nuisances."""
GAP_PRIOR_STD = 1e-3
"""Prior standard deviation of the gap's setting error, m: weak where impacts identify the gap, effective where they do not."""
STATES = ("initial_displacement", "initial_velocity")
"""Per window: u in m and u' in m/s at its first sample; states of effects that do not begin at rest follow."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Layout:
    """Order of a window's vector: shared parameters (internal coordinates), the record's nuisances, the window's initial state."""

    parameters: tuple[Parameter, ...]
    record_parameters: tuple[Parameter, ...] = ()
    """Parameters of effects, one value per record."""
    zeros: tuple[tuple[str, float], ...] = ()
    """Channels with an unknown zero, one per record, and its prior standard deviation, SI."""
    variations: tuple[tuple[str, float], ...] = ()
    """Shared parameters that vary between records, and the standard deviation of their variation in internal coordinates."""
    priors: tuple[tuple[str, float, float], ...] = ()
    """Shared parameters with a normal prior, its mean and its standard deviation, SI."""
    own_states: tuple[OwnState, ...] = ()
    """Own states of effects."""
    files: tuple[str, ...] = ()
    """Files of the records, in the order of their indices."""

    @property
    def nuisances(self) -> tuple[str, ...]:
        """Names of the nuisances: base motion, gap error, zeros, variations, parameters per record."""
        zeros, variations = (f"zero.{channel}" for channel, _ in self.zeros), (f"variation.{name}" for name, _ in self.variations)
        return (*NUISANCES, *zeros, *variations, *(p.name for p in self.record_parameters))

    @property
    def without_effects(self) -> int:
        """Count of nuisances before those of effects."""
        return len(NUISANCES) + len(self.zeros) + len(self.variations)

    @property
    def nuisance_count(self) -> int:
        """Count of nuisances of a record."""
        return self.without_effects + len(self.record_parameters)

    @property
    def varying(self) -> slice:
        """Slice of the variations among the nuisances."""
        return slice(len(NUISANCES) + len(self.zeros), self.without_effects)

    @property
    def free_own(self) -> tuple[int, ...]:
        """Positions in `own_states` of those that do not begin at rest."""
        return tuple(index for index, state in enumerate(self.own_states) if state.scale > 0)

    @property
    def states(self) -> int:
        """Count of initial values of a window."""
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
        """Internal coordinates of shared parameters given by name, SI."""
        return np.array([p.to_internal(values[p.name]) for p in self.parameters])

    def clipped(self, values: dict[str, float]) -> np.ndarray:
        """Internal coordinates of shared parameters given by name, SI, each inside its range."""
        return self.internal({p.name: float(np.clip(values[p.name], p.lower, p.upper)) for p in self.parameters})


@dataclasses.dataclass(frozen=True, kw_only=True)
class Estimate:
    """A point of the fit: shared parameters, nuisances of every record, initial state and random force of every window."""

    shared: np.ndarray
    """(parameters,), internal coordinates."""
    nuisances: np.ndarray
    """(records, nuisances)"""
    states: np.ndarray
    """(windows, states)"""
    force: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    """(windows, knots): random force, N; empty where there is none."""

    def local(self, record: np.ndarray) -> np.ndarray:
        """Vector of every window, (windows, size)."""
        count = len(record)
        return np.concatenate([np.broadcast_to(self.shared, (count, len(self.shared))), self.nuisances[record], self.states], axis=1)

    def moved(self, shared: np.ndarray, nuisances: np.ndarray, states: np.ndarray) -> "Estimate":
        """This point plus a step."""
        return dataclasses.replace(self, shared=self.shared + shared, nuisances=self.nuisances + nuisances, states=self.states + states)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Active:
    """Unknowns that a stage of the fit estimates."""

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
    priors: tuple[tuple[str, float, float], ...] = (),
) -> Layout:
    """Layout of all unknowns: the model's parameters, `extra` shared parameters, sensor zeros, variations between records, and priors."""
    return Layout(
        parameters=(*model.parameters, *extra),
        record_parameters=model.record_parameters,
        zeros=zeros,
        variations=variations,
        priors=priors,
        own_states=tuple(state for effect in model.effects for state in effect.own_states),
        files=files,
    )


def free_nuisances(records: list[Record], layout: Layout, *, any_contact: np.ndarray) -> np.ndarray:
    """(records, nuisances) bool, True for free nuisances: the sine of a driven cart, the gap error where there is contact, and all others.

    A channel that drives the model enters as recorded, with its zero fixed.
    """
    driven = np.array([record.kind == "cart-excitation" and record.base == "sine" for record in records])
    of_effects = np.ones((len(records), len(layout.record_parameters)), bool)
    compared = [frozenset(record.channels) - driving_channels(record) for record in records]
    zeros = np.array([[channel in those for channel, _ in layout.zeros] for those in compared], bool).reshape(len(records), -1)
    variations = np.ones((len(records), len(layout.variations)), bool)
    return np.concatenate([np.stack([driven, driven, any_contact], axis=1), zeros, variations, of_effects], axis=1)
