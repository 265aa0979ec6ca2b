"""The missing force against one that was put in."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.free_form.missing_force import missing_force, window_weights


def inside(at):
    return np.arange(at.ts.shape[1]) < at.lengths[:, None]


def test_an_acceleration_shows_the_force_directly(motion, friction):
    put_in = friction(0.05)
    at = motion.shown(force=put_in)
    force, stderr = missing_force(motion.prepared, at, motion.mass)
    steady = inside(at) & (np.abs(at.v) > 0.03)
    off = (force - put_in)[steady] / stderr[steady]
    assert 0.5 < np.mean(off**2) < 1.5
    assert np.median(stderr[steady]) < 0.015


def test_displacements_show_it_smoothed(motion, friction):
    put_in = friction(0.2)
    at = motion.without(motion.shown(force=put_in), "hammer_acceleration")
    force, stderr = missing_force(motion.prepared, at, motion.mass)
    flight = inside(at) & ~at.in_contact & (np.abs(at.v) > 0.03)
    weight = stderr[flight] ** -2
    assert np.sum(weight * force[flight] * put_in[flight]) / np.sum(weight * put_in[flight] ** 2) == pytest.approx(1.0, abs=0.25)
    assert np.mean(((force - put_in)[flight] / stderr[flight]) ** 2) < 2.0


@pytest.mark.parametrize("unrecorded", [(), ("hammer_acceleration",)], ids=["acceleration", "displacement"])
def test_noise_is_no_force(motion, unrecorded):
    at = motion.without(motion.shown(), *unrecorded)
    force, stderr = missing_force(motion.prepared, at, motion.mass)
    assert np.mean((force / stderr)[inside(at)] ** 2) < 1.2


def test_no_sensor_of_the_hammer_no_force(motion):
    at = motion.without(motion.shown(), "hammer_acceleration", "hammer_displacement")
    assert missing_force(motion.prepared, at, motion.mass) is None


def test_windows_that_could_not_be_integrated_have_no_weight(motion, friction):
    at = motion.shown(force=friction(0.05))
    finite = at.finite.copy()
    finite[3] = False
    lost = dataclasses.replace(at, finite=finite, residual=np.where(finite[:, None, None], at.residual, np.nan))
    force, stderr = missing_force(motion.prepared, lost, motion.mass)
    assert window_weights(lost)[3] == 0.0
    assert np.all(force[3] == 0.0) and np.all(np.isinf(stderr[3]))
    assert np.isfinite(force).all()


def test_padding_has_no_weight(motion):
    at = motion.shown()
    _, stderr = missing_force(motion.prepared, at, motion.mass)
    assert np.isinf(stderr[~inside(at)]).all()
