"""Simulated rigs without a stop."""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.contact_free.rigs import CONCEALED, Job, write_rig
from benchmarks.contact_free.sensors import coloured, drawn, prediction
from benchmarks.contact_free.trial import judged
from identification import diagnose, load_experiment


@pytest.mark.parametrize(("kind", "effect"), [(kind, effect) for kind, effects in CONCEALED.items() for effect in (None, *effects)])
def test_a_rig_is_written_as_an_experiment(tmp_path, kind, effect):
    concealed = write_rig(tmp_path, Job(kind=kind, effect=effect, seed=0, index=0))
    experiment = load_experiment(tmp_path)
    last = "free-decay" if kind == "video" else "forced"
    assert [record.kind for record in experiment.records] == ["free-decay", "free-decay", last]
    assert bool(concealed["effect"] if "effect" in concealed else concealed) == (effect is not None)


def test_a_constant_force_bends_the_path_of_a_rolling_mass(tmp_path):
    """Without a spring, x = x_0 + v t + F t^2 / 2 m."""
    force = write_rig(tmp_path, Job(kind="unsprung", effect="constant_force", seed=0, index=0))["constant_force"]
    experiment = load_experiment(tmp_path)
    record = experiment.records[0]
    curve = np.polyfit(record.time, record.channels["hammer_displacement"], 2)
    assert 2.0 * experiment.mass * curve[0] == pytest.approx(force, rel=1e-3)


def test_friction_is_named_on_a_rig_whose_nominal_model_has_no_parameter(tmp_path):
    """A mass that rolls freely: no spring, no damper, no stop."""
    concealed = write_rig(tmp_path, Job(kind="unsprung", effect="coulomb_friction", seed=0, index=0))
    found = diagnose(load_experiment(tmp_path), only=["coulomb_friction"])
    assert found.effects == ("coulomb_friction",)
    friction = found.diagnosis.effects[0].parameters[0]
    assert abs(friction.value - concealed["friction_force"]) < 4.0 * friction.stderr


TONE, NOTHING = {"errors": {"square": 0.0, "cube": 0.0, "tone": 0.005}}, {"errors": {"square": 0.0, "cube": 0.0, "tone": 0.0}}
CASES = [
    ("quadratic_drag", TONE, "missing", ["quadratic_drag", "reading_tone"], True),
    ("quadratic_drag", TONE, "missing", ["quadratic_drag", "mains_hum"], False),
    ("quadratic_drag", NOTHING, "missing", ["quadratic_drag", "reading_tone"], False),
    ("quadratic_drag", TONE, "missing", ["reading_tone"], False),
    (None, TONE, "missing", ["reading_tone"], True),
    (None, NOTHING, "adequate", [], True),
    (None, NOTHING, "unlisted", [], False),
]


@pytest.mark.parametrize(("effect", "concealed", "verdict", "named", "right"), CASES)
def test_right_is_the_effect_and_nothing_that_does_not_act(effect, concealed, verdict, named, right):
    effects = [{"name": name, "parameters": []} for name in named]
    document = {"verdict": verdict, "effects": effects, "ambiguous_with": [], "warnings": []}
    assert judged(Job(kind="video", effect=effect, seed=0, index=0), concealed, document)["right"] == right


def test_the_noise_of_a_sensor_is_white_behind_its_prediction_filter():
    errors = drawn(np.random.default_rng(3))
    noise = coloured(errors, 50_000, np.random.default_rng(4))
    white = lfilter(prediction(errors), [1.0], noise)[10:]
    assert np.std(noise) == pytest.approx(1.0)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 4.0 / np.sqrt(50_000)
