"""What a small perturbation shows, to first order, against the same motion integrated with the effect."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis.refit import with_model
from identification.diagnosis.score.signature import signatures
from identification.least_squares.fit import as_arrays, integrator_for, on_device
from identification.least_squares.residual import residuals
from identification.likelihood.linearised import linearised
from identification.likelihood.random_force import hats
from identification.likelihood.response import force_responses, response
from identification.windows.layout import Estimate, layout_of
from tests.effects.start import at_start
from tests.identification.conftest import TRUTH
from vibrojax.effects import EFFECTS, StopCompliance

SMALL = {
    "constant_force": {"constant_force": 1e-4},
    "quadratic_drag": {"drag_coefficient": 1e-2},
    "cubic_stiffness": {"cubic_stiffness": 1e3},
    "gap_drift": {"gap_rate": 1e-7},
    "base_harmonics": {"second_sine": 1e-4},
    "frequency_drift": {"drift_rate": 1e-6},
    "gain_error": {"factor": 1.001, "of_channel": "impact_force"},
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", SMALL)
def test_the_first_order_answer_is_that_of_the_integrated_motion(motion, name):
    fields = {p.name: p.field for p in EFFECTS[name].parameters}
    wanted = {fields.get(key, key): value for key, value in SMALL[name].items()}
    none = {p.field: 0.0 for p in EFFECTS[name].parameters} | ({"factor": 1.0} if name == "gain_error" else {})
    effect = dataclasses.replace(at_start(EFFECTS[name]), **(none | wanted))
    prepared = motion.prepared
    (perturbation,) = signatures(motion.at, motion.courses, prepared.layout.files, [effect])
    predicted = response(motion.at, motion.mass, perturbation)

    model = dataclasses.replace(prepared.model.replace(prepared.layout.physical(motion.estimate.shared)), effects=(effect,))
    layout = layout_of(model, files=prepared.layout.files)
    values = {key: float(value) for key, value in model.values().items()}
    shared = layout.internal({p.name: values[p.name] for p in layout.parameters})
    moved = Estimate(shared=shared, nuisances=motion.estimate.nuisances, states=motion.estimate.states)
    group = on_device(prepared.groups[0])
    local = jnp.asarray(moved.local(prepared.record))
    with_effect, _ = residuals(as_arrays(model), layout, integrator_for(prepared), group, local)
    longest = motion.at.ts.shape[1]
    difference = np.asarray(with_effect)[:, :longest] - motion.at.residual

    inside = motion.at.weight > 0
    error = np.sqrt(np.mean((difference - predicted)[inside] ** 2) / np.mean(difference[inside] ** 2))
    assert error < 0.05


STATEFUL = {
    "none": {},
    "second_mode": {"mode_mass": 0.05, "mode_frequency_hz": 25.0, "mode_damping_ratio": 0.02},
    "cart_recoil": {"cart_mass": 2.0, "cart_frequency_hz": 40.0, "cart_damping_ratio": 0.02},
    "hysteresis": {},
    "stop_compliance": {"stop_stiffness": 3e6, "stop_frequency_hz": 400.0, "stop_damping_ratio": 0.2},
}


_SLOW = ("cart_recoil", "hysteresis", "stop_compliance")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.thorough] * (name in _SLOW)) for name in STATEFUL])
def test_the_answer_to_a_force_is_that_of_the_integrated_motion(motion, name):
    """Central differences of the integrated residual; beside effects with states of their own, which the force pushes too."""
    if name == "none":
        prepared = motion.prepared
    else:
        model = motion.prepared.model.replace(TRUTH)
        effect = dataclasses.replace(at_start(EFFECTS[name]), **STATEFUL[name])
        states = np.concatenate([motion.estimate.states, np.zeros((len(motion.estimate.states), len(effect.own_states)))], axis=1)
        model = dataclasses.replace(model, effects=(effect,))
        prepared = with_model(motion.prepared, model, motion.estimate.nuisances, states)
    places, mass = motion.point.variances.places, float(prepared.model.mass)
    none = np.zeros((len(prepared.record), len(places)))
    start = dataclasses.replace(prepared.start if name != "none" else motion.estimate, force=none)
    integrator = integrator_for(prepared)
    at = linearised(prepared, integrator, start, places)
    predicted = force_responses(at, mass, hats(at, places))[:, 5]
    pushed = none.copy()
    pushed[:, 5] = 1e-5
    after, before = (linearised(prepared, integrator, dataclasses.replace(start, force=f), places) for f in (pushed, -pushed))
    difference = (after.residual - before.residual) / 2e-5
    inside = (after.weight > 0) & (np.abs(after.residual) < 1e3) & after.finite[:, None, None]
    error = np.sqrt(np.mean((difference - predicted)[inside] ** 2) / np.mean(difference[inside] ** 2))
    assert error < 0.05


def test_a_sprung_stop_is_followed_at_each_records_own_sampling(motion):
    """Whatever the record that comes first: a tenth of its rate would not do."""
    stop = StopCompliance(stop_stiffness=5e5, stop_frequency_hz=500.0, stop_damping_ratio=0.02)
    files = motion.prepared.layout.files
    fine = dataclasses.replace(motion.courses[0], ts=motion.courses[0].ts / 20.0)
    (alone,) = signatures(motion.at, motion.courses, files, [stop])
    (beside,) = signatures(motion.at, (fine, *motion.courses[1:]), files, [stop])
    others = motion.prepared.record != 0
    assert np.abs(alone.stop_position[others]).max() > 0.0
    np.testing.assert_allclose(beside.stop_position[others], alone.stop_position[others])
