"""A fit on disk: the same fit comes back, and the same page is drawn from it."""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

from identification.commands.run import run_report
from identification.report import write_report
from identification.result.evidence import Unrest
from identification.result.files import StoredFit, fit_dataset, stored_fit
from identification.result.reference import read_reference
from identification.result.result import Added, Horizon
from identification.result.store import from_plain, read_stored, to_plain, write_dataset
from tests.identification.made_result import made_result, with_unknown
from vibrojax.data_files import data_path
from vibrojax.errors import InputError

PROVENANCE = {"seed": 7, "sha256": {"drop.csv": "ab"}, "versions": {"python": "3"}, "seconds": {"fit": 1.5}}


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A fit with what a page can show: a misfit, an undetermined parameter, missing samples, a random force, one held back, a reference."""
    force = Unrest(force_rms=(0.021, None), memory=(8.2e-3, 9e-4), share=0.0123, reference="the spring's force", gain=412.0)
    result = with_unknown(made_result(misfit=0.05, notices=("one <odd> sample",), samples=1000, unrest=force), "zeta")
    gappy = dataclasses.replace(result.records[0], measured={k: v.copy() for k, v in result.records[0].measured.items()})
    gappy.measured["impact_force"][3:9] = np.nan
    apart = dataclasses.replace(result.records[1], file="märz/späteres.csv", nrmse={"impact_force": float("nan")})
    result = dataclasses.replace(result, records=(gappy, result.records[1]), held_back=(apart,), warnings=("look out",))
    added = Added(names=("coulomb_friction",), places=("",), gain=12.5, chance=1e-6, bic=-3.25, held_back=(0.14, 0.0625))
    far = Horizon(periods=None, seconds=0.5, nrmse={"impact_force": 0.25})
    result = dataclasses.replace(result, added=added, held_back=(dataclasses.replace(apart, horizons=(far,)),), smoothed={"n": 1.5})
    reference = read_reference(data_path("thesis", "figure_3_3.toml"))
    stored = StoredFit(result=result, reference=reference, provenance=PROVENANCE)
    folder = tmp_path_factory.mktemp("fit")
    write_dataset(fit_dataset(stored), folder / "result.nc")
    return stored, folder


def test_every_number_comes_back_as_it_was(stored):
    before, after = stored[0], read_stored(stored[1] / "result.nc", {"fit": stored_fit})
    assert after.reference == before.reference and after.result.model.values() == before.result.model.values()
    written, again = {}, {}
    assert to_plain(after, again) == to_plain(before, written)
    assert again.keys() == written.keys()
    for name, one in written.items():
        assert again[name].identical(one), name
    for new, old in zip((*after.result.records, *after.result.held_back), (*before.result.records, *before.result.held_back), strict=True):
        for field in ("time", "relative_displacement", "relative_velocity", "in_contact", "window"):
            assert getattr(new, field).dtype == getattr(old, field).dtype
            np.testing.assert_array_equal(getattr(new, field), getattr(old, field))
        assert (list(new.measured), list(new.predicted)) == (list(old.measured), list(old.predicted))
        for channel, values in old.measured.items():
            np.testing.assert_array_equal(new.measured[channel], values)
    np.testing.assert_array_equal(after.result.correlation, before.result.correlation)
    for record in after.result.experiment.records:
        (of_record,) = [one for one in (*after.result.records, *after.result.held_back) if one.file == record.file]
        np.testing.assert_array_equal(record.time, of_record.time)


def test_the_page_drawn_again_is_the_same_to_the_last_byte(stored, tmp_path):
    first, again = tmp_path / "first", tmp_path / "again"
    first.mkdir()
    again.mkdir()
    write_report(stored[0].result, first, reference=stored[0].reference, provenance=PROVENANCE)
    run_report(stored[1], again)
    assert sorted(path.name for path in first.iterdir()) == sorted(path.name for path in again.iterdir())
    for path in first.iterdir():
        assert path.read_bytes() == (again / path.name).read_bytes(), path.name


def test_other_programs_read_the_series(stored):
    with xr.open_dataset(stored[1] / "result.nc", engine="scipy") as data:
        force = data["record1_measured_impact_force"]
        assert (force.dims, force.attrs["units"], force.attrs["record"]) == (("record1_time",), "N", "drop.csv")
        noise = stored[0].result.records[0].noise["impact_force"]
        expected = (force - data["record1_model_impact_force"]) / noise
        np.testing.assert_allclose(data["record1_residual_impact_force"], expected, rtol=1e-12)
        assert json.loads(data.attrs["fit"])["result"]["parameters"][0]["spec"]["name"] == "k_i"


def test_a_result_that_cannot_be_read_is_one_clear_line(stored, tmp_path):
    with pytest.raises(InputError, match=r"result\.nc does not exist: expected the result\.nc of a fit or a diagnosis"):
        run_report(tmp_path, tmp_path)
    whole = (stored[1] / "result.nc").read_bytes()
    for content in (b"", b"nothing", whole[:5000], whole[: len(whole) // 2], whole.replace(b'"schema": 8,', b'"schema": 9,', 1)):
        (tmp_path / "result.nc").write_bytes(content)
        with pytest.raises(InputError, match=r"cannot be read as a result|is of schema 9: expected 8") as caught:
            read_stored(tmp_path / "result.nc", {"fit": stored_fit})
        assert "\n" not in str(caught.value)


def test_a_changed_number_or_word_is_noticed(stored, tmp_path):
    """One bit of a sample, of a word of the document, of the title, and of a variable's description."""
    whole = (stored[1] / "result.nc").read_bytes()
    with xr.open_dataset(stored[1] / "result.nc", engine="scipy", decode_cf=False) as data:
        sample = data["record1_measured_impact_force"].values[40:44].astype(">f8").tobytes()
    for part in (sample, b"chi2_reduced", b"fitted impact model", b"velocity of u in the fitted motion"):
        place = whole.index(part)
        (tmp_path / "result.nc").write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(InputError, match=r"result.nc is damaged: its content is not that of its checksum; run vibrojax fit again"):
            read_stored(tmp_path / "result.nc", {"fit": stored_fit})


def test_a_law_that_is_not_known_is_refused_with_the_file(stored, tmp_path):
    with xr.open_dataset(stored[1] / "result.nc", engine="scipy", decode_cf=False) as data:
        other = data.load().assign_attrs({"fit": data.attrs["fit"].replace('"name": "hunt-crossley"', '"name": "unknown-law"')})
    del other.attrs["sha256"]
    write_dataset(other, tmp_path / "result.nc")
    with pytest.raises(InputError, match=r"^\S+result\.nc: .*the model in the result.* 'unknown-law'"):
        read_stored(tmp_path / "result.nc", {"fit": stored_fit})


@pytest.mark.parametrize(("kind", "plain"), [(float, "many"), (int, "1"), (str, None), (tuple[int, ...], ["a"]), (tuple[int, int], [1])])
def test_nothing_is_taken_for_another_type(kind, plain):
    with pytest.raises((TypeError, ValueError)):
        from_plain(kind, plain, {})


def test_an_array_has_no_plain_form():
    with pytest.raises(TypeError, match="ndarray has no plain form"):
        to_plain({"a": np.zeros(3)}, {})
