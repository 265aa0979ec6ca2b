import numpy as np
import pytest

from benchmarks.concealed import bic, sindy
from benchmarks.concealed.force_balance import force_balance
from benchmarks.concealed.library import Regression, condensed, regression
from benchmarks.simulator import LISTED, Order, draw_case, write_case


def rig(tmp_path, name=None, channels="all", samples=(2001, 4001), seed=5):
    rng = np.random.default_rng(seed)
    order = Order(kind="stiff", effects=((name, 1.0),) if name else (), channels=channels, samples=samples)
    write_case(tmp_path / "rig", draw_case(rng, order), rng)
    return tmp_path / "rig"


def test_forces_of_a_complete_model_balance(tmp_path):
    law = regression(force_balance(rig(tmp_path)))
    left = law.target - law.nominal @ np.linalg.lstsq(law.nominal, law.target, rcond=None)[0]
    assert np.sum(left**2) / law.count < 1.5
    assert set(law.terms) - {"unlisted"} <= set(LISTED)


def test_condensed_rows_keep_every_sum_of_squares():
    rng = np.random.default_rng(0)
    full = Regression(rng.normal(size=50), rng.normal(size=(50, 2)), {"drag": rng.normal(size=(50, 3))}, 50)
    small = condensed(full)
    assert len(small.target) == 6
    weights = rng.normal(size=5)
    misfits = [np.sum((law.target - np.concatenate([law.nominal, law.terms["drag"]], axis=1) @ weights) ** 2) for law in (full, small)]
    assert misfits[0] == pytest.approx(misfits[1])


@pytest.mark.parametrize("method", [bic, sindy], ids=lambda module: module.NAME)
@pytest.mark.parametrize("name", ["quadratic_drag", "constant_force", "back_stop", "missing_stop"])
def test_plain_effects_are_named_first(tmp_path, name, method):
    assert method.name_effect(rig(tmp_path, name))[0] == name


@pytest.mark.parametrize("channels", ["displacements", "no accelerometer"])
def test_channels_may_be_missing(tmp_path, channels):
    found = bic.name_effect(rig(tmp_path, "constant_force", channels=channels))
    assert "constant_force" in found


def test_search_stops_where_nothing_helps():
    rng = np.random.default_rng(1)
    nominal, drag, other = rng.normal(size=(400, 2)), rng.normal(size=(400, 1)), rng.normal(size=(400, 4))
    target = nominal @ [1.0, 2.0] + rng.normal(size=400)
    assert bic.forward_selection(Regression(target, nominal, {"drag": drag, "other": other}, 400)) == []
    with_drag = Regression(target + 0.5 * drag[:, 0], nominal, {"drag": drag, "other": other}, 400)
    assert bic.forward_selection(with_drag) == ["drag"]


def test_thresholding_keeps_what_acts():
    rng = np.random.default_rng(2)
    nominal, drag, other = rng.normal(size=(400, 2)), rng.normal(size=(400, 1)), rng.normal(size=(400, 4))
    target = nominal @ [1.0, 2.0] + 0.5 * drag[:, 0] + 0.1 * rng.normal(size=400)
    assert sindy.sparse_terms(Regression(target, nominal, {"other": other, "drag": drag}, 400)) == ["drag"]
