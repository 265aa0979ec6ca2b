"""A Peterka map from orbits that are continued from cell to cell: beside iteration, with what coexists, and where none can be followed."""

import json

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from tests.batch.rigs import AMPLITUDE, model
from vibrojax.batch import Span
from vibrojax.effects import CubicStiffness
from vibrojax.presets import read_preset
from vibrojax.studies import peterka
from vibrojax.studies.base import APERIODIC, NO_IMPACT, PERIODIC
from vibrojax.studies.coexistence import of_map, several_in_map
from vibrojax.studies.figures.maps import draw_peterka
from vibrojax.studies.finding import finding
from vibrojax.studies.peterka import APPROACHED, CONTINUED, ITERATED

PLANE = dict(ratio=np.linspace(1.0, 3.8, 16), clearance=np.linspace(0.2, 2.6, 16))


def codes(data) -> np.ndarray:
    own = 1000 * data["impacts"] + data["period"]
    return np.where(data["kind"] == PERIODIC, own, np.where(data["kind"] == NO_IMPACT, 0, -1))


@pytest.fixture(scope="module")
def both():
    """The same map by continued orbits and by iteration."""
    return [peterka(model(), **PLANE, base_amplitude=AMPLITUDE, lyapunov_cycles=0, follow=follow) for follow in (True, False)]


def test_the_map_is_that_of_iteration_away_from_chaos(both):
    ours, plain = both
    wild = (ours["kind"].values == APERIODIC) | (plain["kind"].values == APERIODIC)
    away = np.logical_not(maximum_filter(wild, size=3, mode="nearest"))
    same = codes(ours) == codes(plain)
    beside = (ours["other_code"].values == codes(plain)[..., None]).any(axis=-1)
    assert away.sum() > 80 and len(np.unique(codes(plain)[away])) >= 3
    assert same[away].mean() >= 0.97 and (same | beside)[away].mean() >= 0.99
    strikes = same & away & (plain["kind"].values == PERIODIC)
    np.testing.assert_allclose(ours["impact_force"].values[strikes], plain["impact_force"].values[strikes], rtol=1e-3)
    assert (ours["shown"].values[away] != ITERATED).mean() > 0.99 and (plain["shown"] == ITERATED).all()


def test_fewer_cells_are_left_without_a_period(both):
    """Slow motions have an orbit that Newton's method finds."""
    ours, plain = both
    assert (ours["kind"] == APERIODIC).sum() < (plain["kind"] == APERIODIC).sum()


def test_orbits_beside_that_from_rest_are_named(both):
    """Iteration from a state on the other orbit stays there."""
    from vibrojax.batch import Points, integrate
    from vibrojax.studies.base import classify

    ours = both[0]
    place = np.argwhere((ours["kind"].values == NO_IMPACT) & (ours["other_code"].values > 0).any(axis=-1))
    assert len(place) > 5
    row, column = place[:: max(1, len(place) // 8)].T
    values = {
        "frequency_hz": 4.0 * ours["ratio"].values[column],
        "gap": AMPLITUDE * ours["clearance"].values[row],
        "base_amplitude": AMPLITUDE,
    }
    seen = np.zeros(len(row), bool)
    for back, fast in ((0.1, 2.5), (1.0, 1.0), (2.0, -4.0), (2.0, 4.0), (3.5, -2.0), (5.0, -3.0), (5.0, 1.5), (0.5, -1.0)):
        size = np.maximum(values["gap"], AMPLITUDE)
        start = {"u0": values["gap"] - back * size, "v0": fast * size * 2.0 * np.pi * values["frequency_hz"]}
        found = integrate(model(), Points(coords={"cell": np.arange(float(len(row)))}, values=values | start), span=Span(transient=300))
        kind = classify(found, AMPLITUDE, values["frequency_hz"])
        code = np.where(kind.kind == PERIODIC, 1000 * kind.impacts + kind.period, -1)
        seen |= (ours["other_code"].values[row, column] == code[:, None]).any(axis=1)
    assert seen.mean() > 0.7


def test_a_map_says_where_motions_coexist_and_shows_the_force_beside(both):
    data = of_map(model(), both[0])
    assert json.loads(data.attrs["coexistence"]) == {"starts": 10, "asked": 256, "points": 256, "followed": "from cell to cell"}
    share = 100 * several_in_map(data).mean()
    assert 5 < share < 95
    assert f"several motions coexist in {share:.1f} % of it, " in finding("peterka", data)
    assert "10 starts at each of 256 of 256 points, each motion followed from cell to cell" in finding("peterka", data)
    right = draw_peterka(data).axes[1]
    shown = np.asarray(right.collections[0].get_array()).reshape(16, 16)
    own = (codes(data) == 1001) | (data["other_code"].values == 1001).any(axis=-1)
    np.testing.assert_array_equal(np.isfinite(np.ma.filled(shown, np.nan)), own)


def test_a_band_that_rest_does_not_lead_to_is_in_the_map():
    """At gap 1 mm the wires' z = 1/1 exists below 3 Hz, where the motion from rest has no impact (thesis, figure 3.30)."""
    preset = read_preset("wires")
    ratio = np.array([2.6, 2.7, 2.8]) / preset["natural_frequency_hz"]
    clearance = np.array([0.95e-3, 1e-3]) / preset["base_amplitude"]
    data = peterka(preset.model(), ratio=ratio, clearance=clearance, base_amplitude=preset["base_amplitude"], lyapunov_cycles=0)
    assert (data["kind"] == NO_IMPACT).all() and (data["other_code"] == 1001).any("other").all()
    assert set(np.unique(data["shown"])) <= {APPROACHED, CONTINUED}


def test_a_model_with_effects_is_iterated_and_asked_as_before():
    rig = model(effects=(CubicStiffness(3e5),))
    data = peterka(
        rig, ratio=[1.4, 1.5], clearance=[0.2, 0.4], base_amplitude=AMPLITUDE, span=Span(transient=40, recorded=8), lyapunov_cycles=0
    )
    assert (data["shown"] == ITERATED).all() and (data["other_code"] == -1).all() and (data["asked"] == 0).all()
