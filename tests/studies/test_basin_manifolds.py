"""Manifolds over a picture of basins: they are its boundary, and what is written and said of them."""

import csv
import json
import math

import numpy as np
import pytest
import xarray as xr

from vibrojax.contact import HuntCrossley, Newton
from vibrojax.effects import FallingRestitution, FrequencyDrift, SecondMode
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies import basins
from vibrojax.studies.basin_manifolds import boundary_cells, checked_rig, share_near, with_manifolds
from vibrojax.studies.finding import with_finding
from vibrojax.studies.write import write_study
from vibrojax.suspension import Linear

RIG = Model(0.5, Linear(0.03, 5.0), HuntCrossley(1e6, 1.5, 1.5))
POINT = dict(frequency_hz=8.0, gap=4e-3, base_amplitude=1.5e-3)

GRID = (np.linspace(-8e-3, 4e-3, 40), np.linspace(-0.5, 0.3, 40))


@pytest.fixture(scope="module")
def picture() -> xr.Dataset:
    """Of no impact and z = 1/1, whose saddle lies outside of it."""
    data = basins(RIG, u0=GRID[0], v0=GRID[1], **POINT)
    return with_finding(RIG, data)


@pytest.fixture(scope="module")
def drawn(picture) -> xr.Dataset:
    return with_manifolds(picture, RIG, 1)


def test_all_cells_at_the_boundary_lie_on_the_stable_manifold_of_the_saddle(drawn):
    found = json.loads(drawn.attrs["manifolds"])
    assert found["share_of_boundary"] == 1.0 and found["share_of_picture"] < 0.1
    (saddle,) = found["saddles"]
    assert (saddle["period"], saddle["impacts"], saddle["branches_lost"]) == (1, 1, 0)
    assert saddle["multipliers"][0] > 1.0 > saddle["multipliers"][1] > 0.0
    assert saddle["section"]["u"][0] < -8e-3


def test_it_is_written_drawn_and_said(picture, drawn, tmp_path):
    said = drawn.attrs["finding"]
    assert said.startswith(picture.attrs["finding"])
    assert "1 saddle of 1 cycle: z = 1/1 at -9.372 mm, -0.27" in said and "within one cell of 100.0 % of the " in said
    files = write_study("basins", drawn, tmp_path, stem="basins_gap-0.004")
    assert files[-1].name == "manifolds_gap-0.004.csv"
    with files[-1].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {(row["saddle"], row["manifold"]) for row in rows} == {("1", "stable"), ("1", "unstable")}
    assert all(math.isfinite(float(row["u_m"])) and math.isfinite(float(row["v_m_per_s"])) for row in rows)
    assert len({row["curve"] for row in rows}) >= 4
    assert json.loads((tmp_path / "basins_gap-0.004.json").read_text())["manifolds"]["longest"] == 1
    assert "stable and unstable manifolds" in (tmp_path / "basins_gap-0.004.md").read_text()


def test_a_picture_of_one_motion_has_no_boundary():
    data = basins(RIG, u0=np.linspace(-1e-4, 1e-4, 3), v0=np.linspace(-0.01, 0.01, 3), **POINT)
    assert with_manifolds(data, RIG, 1).attrs["finding"] == "no saddle of 1 cycle found in or near the picture"


def test_a_state_beyond_u_and_its_rate_is_refused():
    model = Model(0.5, Linear(0.03, 5.0), HuntCrossley(1e6, 1.5, 1.5), effects=(SecondMode(0.1, 40.0, 0.01),))
    with pytest.raises(InputError, match="second_mode has a state of its own: expected a model whose state is u and u'"):
        checked_rig(model, 1, *GRID, POINT)


def test_a_rigid_stop_of_more_than_one_restitution_is_refused():
    model = Model(0.5, Linear(0.03, 5.0), Newton(0.7), effects=(FallingRestitution(0.25, 0.1),))
    with pytest.raises(InputError, match="beside falling_restitution: expected a rigid stop of one restitution"):
        checked_rig(model, 1, *GRID, POINT)


def test_no_cycle_no_grid_and_a_drift_are_refused(picture):
    with pytest.raises(InputError, match="saddles of up to 0 cycles are asked for: expected at least 1"):
        checked_rig(RIG, 0, *GRID, POINT)
    drifting = Model(0.5, Linear(0.03, 5.0), HuntCrossley(1e6, 1.5, 1.5), effects=(FrequencyDrift(1e-4),))
    with pytest.raises(InputError, match="frequency_drift does not repeat with the cart"):
        checked_rig(drifting, 1, *GRID, POINT)
    with pytest.raises(InputError, match="on a picture that is no grid"):
        with_manifolds(picture.isel(u0=[3]), RIG, 1)
    with pytest.raises(InputError, match="on a picture that is no grid: expected at least 2 evenly increasing"):
        with_manifolds(picture.isel(u0=[0, 1, 3]), RIG, 1)


def test_cells_near_a_curve_are_counted_where_it_is_not_broken():
    path = np.array([[0.0, 0.0], [2.0, 0.0], [np.nan, np.nan], [6.0, 0.0], [8.0, 0.0]])
    cells = np.array([[1.0, 0.9], [1.0, 1.1], [4.0, 0.0], [7.0, -0.5]])
    assert share_near([path], cells) == 0.5
    assert share_near([], cells) == 0.0
    assert boundary_cells(np.array([[-1, 0], [1, 1]])).tolist() == [[1.0, 0.0], [1.0, 1.0]]
