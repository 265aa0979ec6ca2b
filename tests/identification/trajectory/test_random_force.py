"""The random force between knots, against a fine discretisation of its path."""

import numpy as np
import pytest

from identification.trajectory.random_force import RandomForce

MASS, DURATION = 0.7, 0.02
FORCE = RandomForce(std=1.3, memory=2.0)
"""Slow against the segment: there the path beside the line is a Brownian bridge."""


def test_the_step_keeps_the_stationary_variance():
    correlation, variance = FORCE.step(np.array([0.1, 5.0]))
    assert np.allclose(correlation, np.exp([-0.05, -2.5]))
    assert np.allclose(correlation**2 * FORCE.std**2 + variance, FORCE.std**2)


def test_the_bridge_moves_the_end_as_a_finely_drawn_path_does():
    """Covariance of what the force beside its line does to a free mass, by summation over a fine grid."""
    count = 400
    t = (np.arange(count) + 0.5) * DURATION / count
    slope = 2.0 * FORCE.std**2 / FORCE.memory
    bridge = slope * (np.minimum.outer(t, t) - np.outer(t, t) / DURATION)
    effect = np.stack([DURATION - t, np.ones(count)]) * (DURATION / count) / MASS
    assert np.allclose(FORCE.bridge(np.array([DURATION]), MASS)[0], effect @ bridge @ effect.T, rtol=1e-4)


def test_the_line_and_the_bridge_together_are_the_process():
    """Against the covariance of the Ornstein-Uhlenbeck process itself, in the limit of a short segment."""
    duration, count = 1e-3, 300
    t = (np.arange(count) + 0.5) * duration / count
    process = FORCE.std**2 * np.exp(-np.abs(np.subtract.outer(t, t)) / FORCE.memory)
    ends = FORCE.std**2 * np.exp(-np.abs(np.subtract.outer([0.0, duration], [0.0, duration])) / FORCE.memory)
    line = np.stack([1.0 - t / duration, t / duration], axis=1)
    effect = np.stack([duration - t, np.ones(count)]) * (duration / count) / MASS
    beside = effect @ (process - line @ ends @ line.T) @ effect.T
    assert np.allclose(FORCE.bridge(np.array([duration]), MASS)[0], beside, rtol=2e-2)


@pytest.mark.parametrize("memory", [1e-3, 10.0])
def test_the_bridge_is_a_covariance(memory):
    found = RandomForce(std=2.0, memory=memory).bridge(np.array([1e-3, 0.1]), MASS)
    assert np.all(np.linalg.eigvalsh(found) > 0.0)
