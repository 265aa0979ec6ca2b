"""Basins coloured by attractor, and followed along a parameter, on a rig with motions that coexist."""

import json
import math
from importlib import import_module

import numpy as np
import pytest
import xarray as xr

from vibrojax.batch import Points, Span, grid, integrate
from vibrojax.contact import HuntCrossley
from vibrojax.effects import CubicStiffness
from vibrojax.model import Model
from vibrojax.studies import basins, basins_along
from vibrojax.studies.attractors import settled
from vibrojax.studies.finding import with_finding
from vibrojax.studies.job import Job
from vibrojax.studies.run import make
from vibrojax.studies.write import write_study
from vibrojax.suspension import Linear

RIG = Model(0.5, Linear(0.03, 5.0), HuntCrossley(1e6, 1.5, 1.5))
POINT = dict(gap=4e-3, base_amplitude=1.5e-3)
HERE = (1.5e-3, 1.5e-3 * 2 * np.pi * 11.0)


def plane(count: int) -> dict[str, np.ndarray]:
    return dict(u0=np.linspace(-8e-3, 4e-3, count), v0=np.linspace(-0.5, 0.3, count))


def table(data: xr.Dataset) -> list[dict]:
    return json.loads(data.attrs["attractors"])


@pytest.fixture(scope="module")
def three() -> xr.Dataset:
    return basins(RIG, **plane(16), frequency_hz=11.0, **POINT)


def test_three_motions_coexist_and_each_repeats_after_its_period(three):
    rows = table(three)
    assert {one["name"] for one in rows} == {"no impact", "z = 2/4", "z = 3/4"}
    assert sum(one["share"] for one in rows) == pytest.approx(1.0)
    for number, one in enumerate(rows):
        assert np.sum(three["attractor"] == number) == one["initial_states"]
        start = grid({"u0": [one["section"]["u"][-1]]}, v0=one["section"]["v"][-1], frequency_hz=11.0, **POINT)
        orbit = integrate(RIG, start, span=Span(transient=0, recorded=one["period"], closed=None))
        assert orbit.impacts.sum() == one["impacts"]
        np.testing.assert_allclose(orbit.u[0] / HERE[0], np.array(one["section"]["u"]) / HERE[0], atol=2e-3)
        np.testing.assert_allclose(orbit.v[0] / HERE[1], np.array(one["section"]["v"]) / HERE[1], atol=2e-3)
    quiet = next(number for number, one in enumerate(rows) if one["impacts"] == 0)
    np.testing.assert_array_equal(three["impacting"] == 0, three["attractor"] == quiet)
    assert three.attrs["basin_measure"] == pytest.approx(1.0 - rows[quiet]["share"])


def test_a_tangled_boundary_is_called_fractal_and_everything_is_written(three, tmp_path):
    data = basins(RIG, **plane(40), frequency_hz=11.0, **POINT, span=Span(transient=100), most_cycles=400)
    assert data.attrs["boundary_basin_entropy"] > math.log(2.0) and data.attrs["boundary_dimension"] > 1.5
    said = with_finding(RIG, data)
    assert "it is fractal" in said.attrs["finding"] and said.attrs["finding"].startswith("3 attractors: ")
    files = write_study("basins", said, tmp_path)
    assert [file.suffix for file in files] == [".nc", ".png", ".pdf", ".svg", ".md", ".json"]
    written = json.loads(files[-1].read_text())
    assert written["attractors"] == table(said) and written["basin_entropy"] == data.attrs["basin_entropy"]
    with xr.open_dataset(files[0], engine="scipy") as back:
        np.testing.assert_array_equal(back["attractor"], data["attractor"])


def test_disturbances_within_the_disc_do_not_end_the_motion():
    """States on nine tenths of the radius settle on the motion in the middle; some at one and a half radii do not."""
    data = basins(RIG, **plane(33), frequency_hz=8.0, **POINT)
    quiet = next(one for one in table(data) if one["name"] == "no impact")
    room, omega = quiet["integrity"], 2 * np.pi * 8.0
    assert not room["limited_by_picture"] and room["velocity"] == pytest.approx(omega * room["displacement"])
    angle = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)

    def impacts(factor: float) -> np.ndarray:
        radius = factor * (room["displacement"] - room["resolution"]["displacement"])
        u, v = quiet["section"]["u"][0] + radius * np.cos(angle), quiet["section"]["v"][0] + omega * radius * np.sin(angle)
        points = Points(coords={"angle": angle}, values=dict(u0=u, v0=v, frequency_hz=8.0, **POINT))
        return integrate(RIG, points).impacts.sum(axis=-1)

    assert (impacts(0.98) == 0).all() and (impacts(1.5) > 0).any()


def test_one_colour_says_so_and_proposes_where_two_are_seen():
    data = with_finding(RIG, basins(RIG, **plane(4), frequency_hz=9.0, **POINT))
    said = data.attrs["finding"]
    assert said.startswith("one colour: every initial state ends in no impact; several motions coexist at")
    frequency = float(said.split("--frequency ")[1].split()[0])
    assert frequency != 9.0 and len(table(basins(RIG, **plane(8), frequency_hz=frequency, **POINT))) > 1


def test_motions_without_impact_are_told_apart_too():
    """A suspension that hardens: between its two folds a small and a large motion coexist."""
    model = Model(1.0, Linear(0.02, 1.0), HuntCrossley(1e6, 1.5, 0.3), effects=(CubicStiffness(3e5),))
    data = basins(model, u0=np.linspace(-0.01, 0.01, 4), v0=np.linspace(-0.1, 0.1, 4), frequency_hz=1.25, gap=1.0, base_amplitude=1e-3)
    assert {one["name"] for one in table(data)} == {"no impact a", "no impact b"}
    sizes = [np.hypot(one["section"]["u"][0], one["section"]["v"][0] / (2 * np.pi * 1.25)) for one in table(data)]
    assert max(sizes) > 2 * min(sizes)


@pytest.fixture(scope="module")
def along() -> xr.Dataset:
    return basins_along(RIG, parameter="frequency_hz", values=[7.0, 7.5, 8.0, 8.5], **plane(8), **POINT)


def test_attractors_keep_their_number_along_a_parameter(along, tmp_path):
    rows = table(along)
    assert [set(one["motions"]) for one in rows] == [{"z = 1/1"}, {"no impact"}]
    assert rows[0]["values"] == [7.0, 7.5, 8.0] and rows[1]["values"] == [7.0, 7.5, 8.0, 8.5]
    striking = along["share"].sel(attractor_number=0).values
    assert striking[0] > striking[1] > striking[2] > 0 and np.isnan(striking[3])
    np.testing.assert_allclose(along["share"].sum("attractor_number"), 1.0)
    alone = basins(RIG, **plane(8), frequency_hz=7.5, **POINT)
    assert {one["name"]: one["share"] for one in table(alone)} == pytest.approx(
        {"z = 1/1": striking[1], "no impact": along["share"].values[1, 1]}
    )
    assert "z = 1/1 at 7 to 8 Hz" in along.attrs["finding"] and "no impact at 7 to 8.5 Hz" in along.attrs["finding"]
    assert write_study("basins_along", along, tmp_path)[1].stat().st_size > 5000


def test_an_attractor_that_no_initial_state_leads_to_is_followed_with_the_share_zero():
    """The only initial state stops striking between 7 and 8 Hz; the motion that strikes ends at its fold beyond 8 Hz."""
    one = dict(u0=[-2e-3], v0=[0.0])
    data = basins_along(RIG, parameter="frequency_hz", values=[7.0, 7.5, 8.0, 8.5], **one, **POINT)
    shares = data["share"].values
    assert table(data)[0]["motions"] == ["z = 1/1"] * 3
    first = int(np.argmax(shares[:, 0] == 0.0))
    assert shares[0, 0] == 1.0 and first > 0 and (shares[first:3, 0] == 0.0).all() and np.isnan(shares[3, 0])


def test_motions_from_attractors_are_integrated_as_long_as_those_of_the_grid(monkeypatch):
    asked = []

    def watched(model, points, **how):
        asked.append((how["span"], how["most_cycles"]))
        return settled(model, points, **how)

    for module in ("basins", "basins_along"):
        monkeypatch.setattr(import_module(f"vibrojax.studies.{module}"), "settled", watched)
    span = Span(transient=120)
    basins_along(RIG, parameter="frequency_hz", values=[7.0, 7.1, 7.2], u0=[-2e-3], v0=[0.0], span=span, most_cycles=400, **POINT)
    assert asked == [(span, 400)] * 3


@pytest.mark.parametrize("study", ["basins", "basins_along"])
def test_a_store_gives_the_same_attractors(study, along, tmp_path):
    pytest.importorskip("zarr")
    settings = POINT | ({"parameter": "frequency_hz"} if study == "basins_along" else {"frequency_hz": 7.5})
    axes = plane(8) | ({"values": [7.0, 7.5, 8.0, 8.5]} if study == "basins_along" else {})
    found = make(Job(study=study, model=RIG, axes=axes, settings=settings, points=40), store=tmp_path / "a.zarr")
    plain = along if study == "basins_along" else with_finding(RIG, basins(RIG, **axes, **settings))
    np.testing.assert_array_equal(found["attractor"], plain["attractor"])
    assert found.attrs["finding"] == plain.attrs["finding"]
