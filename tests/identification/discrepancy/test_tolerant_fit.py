"""What a fit holds while all else gives way to a new effect."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.refit import with_model
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.levenberg_marquardt import LevenbergMarquardt
from vibrojax.effects import CoulombFriction


@pytest.mark.parametrize(("newest", "first_holds"), [("coulomb_friction", True), ("", False)])
def test_all_else_gives_way_to_the_newest_effect_before_it_moves(motion, allowed, monkeypatch, newest, first_holds):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.01),))
    prepared = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index, free = prepared.layout.index("coulomb_friction.friction_force"), []
    minimise = LevenbergMarquardt.__call__

    def watched(self, evaluate, start, active, limits):
        free.append(bool(active.shared[index]))
        return minimise(self, evaluate, start, active, limits)

    monkeypatch.setattr(LevenbergMarquardt, "__call__", watched)
    fitted = fit_tolerantly(prepared, allowed, newest=newest, rounds=1)
    assert free[0] is not first_holds
    assert all(free[1:])
    assert fitted is not None
    assert np.isfinite(fitted.chi2)
