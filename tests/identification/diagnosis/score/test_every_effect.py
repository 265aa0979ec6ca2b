"""One step from the nominal model estimates every listed effect as strong as it is in the records."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis.refit import with_model
from identification.diagnosis.score.probe_scales import probe_scales
from identification.diagnosis.score.score import information, projector, reduced, score
from identification.diagnosis.score.signature import own_states, signatures
from identification.least_squares.fit import as_arrays, integrator_for, on_device
from identification.least_squares.residual import residuals
from identification.likelihood.response import response
from tests.identification.conftest import TRUTH
from vibrojax.effects import EFFECTS

GAIN = 30.0
"""Fall of chi-square due to an effect that is small enough for its first order to hold."""
AS_PROBED = {
    "force_lag": (0.95, 1.05),
    "sensor_high_pass": (0.95, 1.05),
    "force_clipping": (0.95, 1.05),
    "time_offset": (0.5, 1.0),
    "clock_drift": (0.5, 1.0),
    "recorder_low_pass": (0.5, 1.0),
    "stop_compliance": (0.5, 1.0),
    "back_stop": (0.2, 1.0),
}
"""Effects that are not in proportion to a strength: these are in the records as strong as they are probed, and first order finds what part
of it."""


@pytest.fixture(scope="module")
def nominal(motion):
    """The nominal model where it explains every sample exactly, and the scales from which candidates derive."""
    return motion.fitted(motion.shown(noise=False)), probe_scales(motion.prepared, motion.at, motion.estimate)


def changed_by(motion, effect) -> np.ndarray:
    """What an effect adds to the residual where the model contains it: integrated, (windows, time, channels)."""
    prepared, estimate = motion.prepared, motion.estimate
    model = dataclasses.replace(prepared.model.replace(TRUTH), effects=(effect,))
    along = own_states(effect, motion.courses)
    free = [index for index, state in enumerate(effect.own_states) if state.scale > 0]
    first = np.concatenate([group.first for group in prepared.groups])
    begin = np.array([[along[record][at, index] for index in free] for record, at in zip(prepared.record, first, strict=True)])
    of_records = [getattr(effect, p.field) / p.scale for p in model.record_parameters]
    nuisances = np.concatenate([estimate.nuisances, np.tile(of_records, (len(estimate.nuisances), 1))], axis=1)
    there = with_model(prepared, model, nuisances, np.concatenate([estimate.states, begin.reshape(len(first), len(free))], axis=1))
    (group,) = prepared.groups
    local = jnp.asarray(there.start.local(prepared.record))
    found, _ = residuals(as_arrays(model), there.layout, integrator_for(there), on_device(group), local)
    return np.where(motion.at.weight > 0, np.asarray(found)[:, : motion.at.ts.shape[1]] - motion.at.residual, 0.0)


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "missing_stop"])
def test_an_effect_is_estimated_in_one_step(motion, nominal, name):
    """But a stop that was left out, of which no first order says anything: it is fitted whatever its score."""
    fitted, scales = nominal
    candidates = EFFECTS[name].probe.candidates(scales)
    member = candidates[len(candidates) // 2][0]
    strength = 1.0
    if name not in AS_PROBED:
        (perturbed,) = signatures(motion.at, motion.courses, motion.prepared.layout.files, [member])
        by = projector(fitted)
        _, matrix = information(by, reduced(by, response(motion.at, motion.mass, perturbed)[:, None]))
        strength = float(np.sqrt(GAIN / matrix[0, 0]))
    at = motion.shown(noise=False)
    recorded = dataclasses.replace(at, residual=at.residual - changed_by(motion, member.scaled(strength)))
    (found,) = score(motion.prepared, projector(motion.fitted(recorded)), motion.courses, [(member,)], motion.mass)
    low, high = AS_PROBED.get(name, (0.95, 1.05))
    assert found.gain > 0.9 * GAIN
    assert np.all(low * strength < found.factors) and np.all(found.factors < high * strength)
