import numpy as np
import pytest

from identification.experiment import load_experiment
from identification.experiment.samples import find_saturation

TIME = np.arange(8000) / 4000.0


def pulses(height=50.0):
    """Eleven half-sine impacts of about 10 ms, N."""
    phase = np.mod(5.13 * TIME, 1.0)
    return np.where(phase < 0.05, height * np.sin(np.pi * phase / 0.05), 0.0)


def quantised(values, step):
    return np.round(values / step) * step


@pytest.mark.parametrize("step", [1e-9, 0.06])
@pytest.mark.parametrize("std", [0.0, 0.15])
def test_cut_impacts_are_found(step, std):
    noisy = pulses() + np.random.default_rng(1).normal(0.0, 1.0, TIME.size) * std
    (found,) = find_saturation(quantised(np.minimum(noisy, 40.0), step))
    assert (found.side, found.runs) == ("largest", 11)
    assert found.level == pytest.approx(40.0, abs=step)
    assert found.samples == pytest.approx(11 * 0.41 * 39, rel=0.1)


def test_both_sides_of_a_cut_sine_are_found():
    found = find_saturation(np.clip(np.sin(40.0 * TIME), -0.9, 0.8))
    assert [(each.side, each.level) for each in found] == [("largest", 0.8), ("smallest", -0.9)]


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(pulses(), id="force that rests at exactly zero"),
        pytest.param(pulses() + 3.3, id="force that rests at an offset"),
        pytest.param(quantised(pulses() + np.random.default_rng(2).normal(0.0, 0.02, TIME.size), 0.06), id="coarse force at rest"),
        pytest.param(quantised(1e-3 * np.sin(20.0 * TIME), 1e-5), id="crests flattened by quantisation"),
        pytest.param(quantised(1e-3 * np.sin(20.0 * TIME), 1e-4), id="crests flattened by coarse quantisation"),
        pytest.param(np.array([float(f"{value:.3e}") for value in 1e-3 * np.sin(20.0 * TIME)]), id="crests flattened by few digits"),
        pytest.param(np.where(TIME < 0.5, -3e-3, -3e-3 * np.exp(-TIME + 0.5) * np.cos(30 * (TIME - 0.5))), id="hammer held, then released"),
        pytest.param(np.random.default_rng(3).integers(0, 3, TIME.size) * 1e-6, id="nothing but quantised noise"),
        pytest.param(np.zeros(100), id="constant"),
        pytest.param(np.full(100, np.nan), id="no sample"),
    ],
)
def test_no_false_alarm(values):
    assert find_saturation(values) == ()


@pytest.mark.thorough
def test_development_cases_alarm_only_where_the_force_is_cut(shared):
    alarmed = set()
    for folder in sorted((shared / "concealed").glob("case-*")):
        for record in load_experiment(folder).records:
            reported = [notice for notice in record.notices if "saturates" in notice]
            alarmed |= {(folder.name, notice.split(":")[0]) for notice in reported}
    assert alarmed == {("case-14", "impact_force")}
