"""A saturating spring beside a complete model: its expected gain must be no more than that of noise, and it must be found where it acts."""

import numpy as np

from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.score.probe_scales import probe_scales
from identification.diagnosis.score.score import projector, score
from identification.likelihood.evidence import chance
from vibrojax.effects import ForceSaturation


def best_candidate(motion, at):
    """The best candidate, and how likely noise alone gives its expected gain."""
    candidates = list(ForceSaturation.probe.candidates(probe_scales(motion.prepared, at, motion.estimate)))
    best = score(motion.prepared, projector(motion.fitted(at)), motion.courses, candidates, motion.mass)[0]
    return best, chance(best.gain, best.degrees, len(candidates))


def test_a_complete_model_asks_for_no_saturation(motion):
    assert best_candidate(motion, motion.shown())[1] > ALPHA


def test_saturation_is_seen_where_it_acts(motion):
    threshold = 0.2 * np.abs(motion.at.u).max()
    best, by_chance = best_candidate(motion, motion.shown(force=-0.05 * np.clip(motion.at.u / threshold, -1.0, 1.0)))
    assert by_chance < ALPHA
    assert float(best.factors[0]) * best.members[0].saturation_force > 0.0
