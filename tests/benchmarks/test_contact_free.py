"""Simulated rigs without a stop."""

import numpy as np
import pytest

from benchmarks.contact_free.rigs import CONCEALED, Job, write_rig
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
