"""Motions beside the one that a study shows: the thesis's facts that the presets carry, and what a sentence says of them."""

import json

import numpy as np
import pytest
import xarray as xr

from tests.batch.rigs import AMPLITUDE, model
from vibrojax.presets import read_preset
from vibrojax.presets.facts import FACTS, GRID_HZ, BandPlace, Coexistence
from vibrojax.studies import coexistence, frequency_response, section
from vibrojax.studies.coexistence import APERIODIC_CODE, own_motions, with_coexistence
from vibrojax.studies.finding import finding

ANSWERED = {(fact.preset, fact.gap) for fact in FACTS if isinstance(fact, BandPlace)}


def curve(data: xr.Dataset, of: int) -> np.ndarray:
    """Largest force on one motion along the frequency of a response at one gap; NaN where that does not exist."""
    own = [
        {1000 * p + q} if kind == 1 else {0} for kind, p, q in zip(*(data[n].values for n in ("kind", "impacts", "period")), strict=True)
    ]
    force = np.where([of in here for here in own], data["impact_force"].values, np.nan)
    beside = np.where(data["other_code"].values == of, data["other_force"].values, np.nan)
    return np.fmax(force, np.fmax.reduce(beside, axis=1))


def response(name: str, gap: float, frequencies: np.ndarray) -> xr.Dataset:
    preset = read_preset(name)
    rig = preset.model()
    data = frequency_response(rig, frequency_hz=frequencies, gap=[gap], base_amplitude=preset["base_amplitude"])
    return with_coexistence(rig, data).isel(gap=0)


def check_bands(name: str, gap: float, data: xr.Dataset) -> int:
    """Every stated place of a band is where the response has it, if the preset reproduces it at all; how many that are."""
    x, checked = data["frequency_hz"].values, 0
    for fact in FACTS:
        if isinstance(fact, BandPlace) and (fact.preset, fact.gap) == (name, gap) and fact.ask().reproduced:
            force = curve(data, 1000 + fact.cycles)
            place = x[np.nanargmax(force)] if fact.place == "largest" else x[np.isfinite(force)].max()
            assert abs(place - fact.values[0]) <= GRID_HZ + np.diff(x).max(), (fact.statement, place)
            checked += 1
    return checked


def test_a_response_knows_the_band_that_rest_does_not_lead_to():
    """At gap 1 mm the wires' z = 1/1 is largest at 3 Hz, where the motion from rest has no impact."""
    data = response("wires", 1e-3, np.arange(2.6, 3.3, 0.05))
    assert (data["kind"] == 0).all()
    force = curve(data, 1001)
    assert abs(data["frequency_hz"].values[np.nanargmax(force)] - 3.0) <= GRID_HZ
    said = finding("response", data.expand_dims("gap").assign_coords(gap=("gap", [1e-3], {"units": "m"})))
    assert "no motion with impacts; rest and z = 1/1 coexist from 2.6 to " in said
    assert "N on z = 1/1 at" in said and "(10 starts at each of 14 of 14 points, each motion followed up and down)" in said


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "gap"), sorted(ANSWERED))
def test_the_response_of_a_preset_has_the_stated_bands(name, gap):
    low, high = read_preset(name).ranges["frequency_hz"]
    assert check_bands(name, gap, response(name, gap, np.linspace(low, high, 151))) >= 1


@pytest.mark.thorough
@pytest.mark.parametrize("name", sorted({fact.preset for fact in FACTS if isinstance(fact, Coexistence)}))
def test_sections_find_the_stated_coexistence(name):
    preset, found = read_preset(name), []
    for fact in (fact for fact in FACTS if isinstance(fact, Coexistence) and fact.preset == name and fact.ask().reproduced):
        ratio, clearance = fact.values
        amplitude = preset["base_amplitude"]
        rig, at = preset.model(), dict(frequency_hz=ratio * preset["natural_frequency_hz"], gap=clearance * amplitude)
        data = with_coexistence(rig, section(rig, base_amplitude=amplitude, strobes=16, even=True, **at))
        codes = own_motions(data)[0] | {int(of) for of in data["other_code"].values if of >= 0}
        found.append(0 in codes and bool(codes - {0}))
    assert found and all(found)


def test_one_motion_alone_is_said_to_be_alone():
    data = frequency_response(model(), frequency_hz=[5.0, 5.2, 5.4], gap=[1e-3], base_amplitude=AMPLITUDE)
    found = with_coexistence(model(), data)
    assert (found["other_code"] == -1).all() and (found["asked"] == 1).all()
    assert "no motions that coexist (10 starts at each of 3 of 3 points" in finding("response", found)
    assert json.loads(found.attrs["coexistence"]) == {"starts": 10, "asked": 3, "points": 3, "followed": True}


def test_motions_have_names():
    assert [coexistence.name(of) for of in (0, APERIODIC_CODE, 2003)] == ["rest", "aperiodic impacts", "z = 2/3"]
