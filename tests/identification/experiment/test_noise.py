import numpy as np
import pytest

from identification.experiment import load_experiment
from identification.experiment.noise import estimate_noise


def rig_signal(samples):
    """A sine with a short half-sine impact in every cycle, SI."""
    time = np.arange(samples) / 4000.0
    phase = np.mod(6.25 * time, 1.0)
    return 2e-3 * np.sin(2 * np.pi * 6.25 * time) + np.where(phase < 0.03, 1e-3 * np.sin(np.pi * phase / 0.03), 0.0)


@pytest.mark.parametrize("std", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_signal_does_not_count(std, seed):
    noise = np.random.default_rng(seed).normal(0.0, std, 12_000)
    assert estimate_noise(rig_signal(12_000) + noise) == pytest.approx(std, rel=0.05)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 10.0])
def test_quantisation_adds_its_own(ratio):
    step = 1e-6
    noise = np.random.default_rng(5).normal(0.0, ratio * step, 12_000)
    quantised = np.round((rig_signal(12_000) + noise) / step) * step
    assert estimate_noise(quantised) == pytest.approx(step * np.sqrt(ratio**2 + 1 / 12), rel=0.1)


def test_a_channel_at_rest_has_the_noise_of_its_quantisation():
    at_rest = np.zeros(4000)
    at_rest[[500, 900, 901, 2500]] = 0.061
    assert estimate_noise(at_rest) == pytest.approx(0.061 / np.sqrt(12))


def test_the_estimate_scales_and_ignores_an_offset():
    values = np.random.default_rng(6).normal(0.0, 1.0, 3000)
    assert estimate_noise(1e-5 * values + 3.0) == pytest.approx(1e-5 * estimate_noise(values), rel=1e-6)


def test_samples_that_are_missing_do_not_count():
    values = np.random.default_rng(7).normal(0.0, 1.0, 12_000)
    values[100:300] = np.nan
    values[::50] = np.nan
    assert estimate_noise(values) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("values", [np.zeros(100), np.full(100, np.nan), np.arange(10.0), np.full(200, 3.3)])
def test_without_usable_samples_there_is_no_estimate(values):
    assert estimate_noise(values) is None


@pytest.mark.thorough
def test_agrees_with_what_the_development_cases_declare(shared):
    for folder in sorted((shared / "concealed").glob("case-*")):
        experiment = load_experiment(folder)
        for record in experiment.records:
            for channel, values in record.channels.items():
                step = np.diff(np.unique(values)).min()
                declared = np.hypot(experiment.sensors[channel].noise, step / np.sqrt(12.0))
                assert estimate_noise(values) == pytest.approx(declared, rel=0.15), (folder.name, record.file, channel)
