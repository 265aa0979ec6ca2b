"""Windows of the embedded example along its true motion, with residuals made to order."""

import dataclasses
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis.refit import with_model
from identification.diagnosis.score.signature import Course, courses
from identification.estimation.short_windows import SHORT
from identification.least_squares.fit import as_arrays, integrator_for, on_device
from identification.least_squares.residual import predict
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.response import Perturbation, response
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared, prepare
from tests.identification.conftest import TRUTH, cropped
from tests.identification.diagnosis import made_fit
from vibrojax.effects import AbstractEffect


@dataclasses.dataclass(frozen=True)
class Motion:
    """The example's nominal model, its motion, and what any misfit would be there."""

    point: Point
    """Where a fit in the whole likelihood would begin."""
    courses: tuple[Course, ...]

    @property
    def prepared(self) -> Prepared:
        """Windows and model."""
        return self.point.prepared

    @property
    def estimate(self) -> Estimate:
        """With the true parameters, and no random force."""
        return self.point.estimate

    @property
    def at(self) -> Linearised:
        """The windows, with the residuals of the records."""
        return self.point.at

    @property
    def mass(self) -> float:
        """kg"""
        return self.prepared.experiment.mass

    def recorded(self, effect: AbstractEffect) -> Fitted:
        """The nominal model, fitted to the windows as they would have been recorded with an effect and noise."""
        prepared, model = self.prepared, dataclasses.replace(self.prepared.model.replace(TRUTH), effects=(effect,))
        own = np.zeros((len(self.estimate.nuisances), len(model.record_parameters)))
        true = with_model(prepared, model, np.concatenate([self.estimate.nuisances, own], axis=1), self.estimate.states)
        (group,) = prepared.groups
        local = jnp.asarray(true.start.local(prepared.record))
        predicted, _ = predict(as_arrays(model), true.layout, integrator_for(true), on_device(group), local)
        noise = np.random.default_rng(3).standard_normal(group.measured.shape) / np.where(group.weight > 0, group.weight, np.inf)
        heard = dataclasses.replace(group, measured=np.where(group.weight > 0, np.asarray(predicted) + noise, group.measured))
        start = dataclasses.replace(prepared, groups=(heard,), start=self.estimate)
        return fitted(first_point(start, dataclasses.replace(self.estimate, force=np.zeros((0, 0)))))

    def shown(self, *, force: np.ndarray | float = 0.0, readings: dict[str, np.ndarray] | None = None, noise: bool = True) -> Linearised:
        """The same with residuals of noise, of a force on the hammer that the model leaves out, and of what sensors add."""
        none = np.zeros_like(self.at.u)
        missing = Perturbation(
            force=none + force,
            stop_position=none,
            stop_velocity=none,
            base_displacement=none,
            base_acceleration=none,
            readings=readings or {},
        )
        drawn = np.random.default_rng(7).standard_normal(self.at.residual.shape) * noise
        residual = np.where(self.at.weight > 0, drawn, 0.0) - response(self.at, self.mass, missing)
        return dataclasses.replace(self.at, residual=_without_initial_states(self, residual))

    def without(self, at: Linearised, *names: str) -> Linearised:
        """As if some channels had not been recorded."""
        kept = np.array([name not in names for name in at.channels])
        return dataclasses.replace(at, weight=at.weight * kept, residual=at.residual * kept, jacobian=at.jacobian * kept)

    def fitted(self, at: Linearised, **variances) -> Fitted:
        """The nominal model, fitted where these are the residuals."""
        return made_fit.fitted(self.point, at, **variances)


def _without_initial_states(motion: Motion, residual: np.ndarray) -> np.ndarray:
    """What is left when every window has chosen its initial state anew, as the fit would."""
    layout = motion.prepared.layout
    columns = motion.at.jacobian[:, layout.size - layout.states :].reshape(len(residual), layout.states, -1).transpose(0, 2, 1)
    flat = residual.reshape(len(residual), -1, 1)
    return (flat - columns @ (np.linalg.pinv(columns) @ flat)).reshape(residual.shape)


@pytest.fixture(scope="session")
def motion(example) -> Motion:
    """0.75 s of each of the four records."""
    prepared = prepare(cropped(example, 3000, (0, 1, 2, 3)), window=SHORT)
    layout = prepared.layout
    estimate = dataclasses.replace(prepared.start, shared=layout.internal(layout.physical(prepared.start.shared) | TRUTH))
    point = first_point(prepared, estimate)
    return Motion(point, courses(prepared, point.at, point.estimate))


@pytest.fixture(scope="session")
def recovered(motion) -> Fitted:
    """The nominal model fitted to its records."""
    return fitted(motion.point)


@pytest.fixture(scope="session")
def friction(motion) -> Callable[[float], np.ndarray]:
    """Dry friction along the motion, N, of a given size."""
    return lambda size: -size * np.tanh(motion.at.v / 2e-3)
