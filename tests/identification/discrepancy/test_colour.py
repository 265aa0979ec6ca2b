import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from identification.discrepancy.colour import overstatement

WINDOWS, SAMPLES = 42, 250
T = np.arange(SAMPLES)


def noise(colour: float, seed: int) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal((WINDOWS, SAMPLES))
    later = lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white[:, 1:], axis=1, zi=colour * white[:, :1])[0]
    return np.concatenate([white[:, :1], later], axis=1)


def column(windows: int) -> np.ndarray:
    shape = np.zeros((WINDOWS, SAMPLES))
    shape[:windows] = np.sin(2 * np.pi * 3 * T / SAMPLES)
    return shape


def drop_and_factor(shape: np.ndarray, residual: np.ndarray) -> tuple[float, float]:
    """One strength fitted: the drop of chi-square, and by how much it overstates."""
    strength = np.sum(shape * residual) / np.sum(shape**2)
    factor = overstatement(residual[..., None], (residual - strength * shape)[..., None])
    return strength**2 * np.sum(shape**2), factor


def test_white_noise_changes_nothing():
    factors = [drop_and_factor(column(42), noise(0.0, seed))[1] for seed in range(200)]
    assert np.mean(np.array(factors) == 1.0) > 0.98
    drop, factor = drop_and_factor(column(42), noise(0.0, 1) + 0.3 * column(42))
    assert factor == 1.0 and drop > 300.0


@pytest.mark.parametrize("windows", [42, 4, 1])
@pytest.mark.parametrize("colour", [0.5, 0.9])
def test_coloured_noise_is_no_evidence_once_it_is_known(windows, colour):
    limit = chi2.isf(1e-4, 1)
    found = np.array([drop_and_factor(column(windows), noise(colour, seed)) for seed in range(300)])
    assert np.mean(found[:, 0] > limit) > 0.01
    assert np.mean(found[:, 0] / found[:, 1] > limit) <= 0.007


def test_a_real_effect_in_coloured_noise_is_still_evidence():
    drop, factor = drop_and_factor(column(42), noise(0.9, 3) + 1.0 * column(42))
    assert 2.0 < factor < 20.0
    assert drop / factor > 200.0


def test_nothing_changed_is_nothing_overstated():
    residual = noise(0.9, 0)[..., None]
    assert overstatement(residual, residual) == 1.0
    assert overstatement(residual[:, :8], 0.5 * residual[:, :8]) == 1.0
