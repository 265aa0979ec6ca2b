"""A diagnosis on disk: the same diagnosis comes back, and the same page is drawn from it."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

from identification.commands.run import run_report
from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, UNLISTED
from identification.diagnosis.files import StoredDiagnosis, diagnosis_dataset, diagnosis_provenance, stored_diagnosis
from identification.report import write_diagnosis_report
from identification.result.files import plain, stored_fit
from identification.result.store import read_stored, write_dataset
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result
from vibrojax.errors import InputError
from vibrojax.json_file import write_json

VERDICTS = (MISSING, UNLISTED, UNDECIDED, ADEQUATE, RESTLESS)


@pytest.fixture(scope="module", params=VERDICTS)
def stored(request, tmp_path_factory):
    """A diagnosis with a record held back, a profile without an end, and an error that is no number."""
    result = made_result(samples=1000)
    apart = dataclasses.replace(result.records[1], file="später.csv", nrmse={"impact_force": float("nan")})
    diagnosis = made_diagnosis(result, request.param)
    side = dataclasses.replace(diagnosis.nominal, held_back=(apart,), held_out_nrmse=float("nan"))
    both = {"nominal": side} | ({"augmented": side} if request.param in (ADEQUATE, RESTLESS) else {})
    if diagnosis.location is not None:
        both |= {"location": dataclasses.replace(diagnosis.location, interval=(float("-inf"), 1.0))}
    diagnosis = dataclasses.replace(diagnosis, **both)
    folder = tmp_path_factory.mktemp(request.param)
    found = StoredDiagnosis(diagnosis=diagnosis, provenance=diagnosis_provenance(diagnosis))
    write_dataset(diagnosis_dataset(found), folder / "result.nc")
    return found, folder


def test_every_number_comes_back_as_it_was(stored, tmp_path):
    before, after = stored[0], read_stored(stored[1] / "result.nc", {"diagnosis": stored_diagnosis})
    texts = []
    for one in (before, after):
        write_json(plain(one.diagnosis.document(dict(one.provenance))), tmp_path / "diagnosis.json")
        texts.append((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert texts[0] == texts[1]
    assert (after.diagnosis.augmented is after.diagnosis.nominal) == before.diagnosis.is_complete
    assert after.diagnosis.unrest == before.diagnosis.unrest
    assert after.diagnosis.reading_error == before.diagnosis.reading_error
    assert [record.file for record in after.diagnosis.nominal.held_back] == ["später.csv"]
    old, new = before.diagnosis.location, after.diagnosis.location
    assert (old is None) == (new is None)
    for one, other in zip(*(place.profiles for place in (old, new)), strict=True) if old is not None else ():
        np.testing.assert_array_equal(other.mean, one.mean)


def test_the_page_drawn_again_is_the_same_to_the_last_byte(stored, tmp_path):
    first, again = tmp_path / "first", tmp_path / "again"
    first.mkdir()
    again.mkdir()
    write_diagnosis_report(stored[0].diagnosis, first, provenance=stored[0].provenance)
    run_report(stored[1], again)
    assert sorted(path.name for path in first.iterdir()) == sorted(path.name for path in again.iterdir())
    for path in first.iterdir():
        assert path.read_bytes() == (again / path.name).read_bytes(), path.name


def test_other_programs_read_profiles_and_maps(stored):
    with xr.open_dataset(stored[1] / "result.nc", engine="scipy") as data:
        assert data["nominal_record1_measured_impact_force"].attrs["units"] == "N"
        place = stored[0].diagnosis.location
        assert ("profile1_mean" in data) == ("map1" in data) == (place is not None)
        if place is not None:
            assert (data["profile1_center"].attrs["units"], data["profile1_mean"].attrs["units"]) == ("m/s", "N")
            assert data["map1"].attrs["record"] == "drop.csv"


def test_a_diagnosis_is_no_fit(stored):
    with pytest.raises(InputError, match="is no result of a fit: run vibrojax fit again"):
        read_stored(stored[1] / "result.nc", {"fit": stored_fit})
