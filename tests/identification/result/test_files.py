import dataclasses
import json

import numpy as np
import pytest

from identification.result.evidence import Unrest
from identification.result.files import fit_json, plain
from identification.result.result import Horizon
from tests.identification.made_result import made_result, with_unknown
from vibrojax.json_file import write_json


@pytest.fixture(scope="module")
def result():
    return made_result(samples=300)


def test_the_document_is_what_others_rely_on(result):
    document = fit_json(result)
    assert document["schema"] == 1
    assert list(document["parameters"]) == ["k_i", "n", "lambda_i", "zeta", "f_n"]
    k_i = document["parameters"]["k_i"]
    assert {key: k_i[key] for key in ("value", "stderr", "ci95", "unit", "status")} == {
        "value": 2e6,
        "stderr": 2e3,
        "ci95": [2e6 * 0.998, 2e6 * 1.002],
        "unit": "N/m^n",
        "status": "ok",
    }
    assert document["chi2_reduced"] == result.chi2_reduced
    assert document["correlation"]["names"] == list(document["parameters"])
    assert document["correlation"]["matrix"][0][0] == 1.0
    record = document["records"][1]
    assert (record["file"], set(record["nrmse"])) == ("cart1.csv", set(result.records[1].measured))
    assert record["nuisances"]["gap_error"] == {"value": 1e-6, "stderr": 2e-7, "unit": "m"}


def test_noise_and_random_force_are_those_that_were_found(result):
    document = fit_json(result)
    assert document["unrest"] is None
    assert document["reading_error"]["impact_force"] == {
        "rms": pytest.approx(0.153),
        "unit": "N",
        "order": 3,
        "over_noise": 1.02,
        "variance": 1.01,
        "correlation": -0.01,
        "samples": 4000,
    }
    assert document["force_share"] == 0.0
    force = Unrest(force_rms=(0.02, None), memory=(8e-3, 1e-3), share=0.012, reference="the spring's force", gain=40.0)
    assert fit_json(dataclasses.replace(result, unrest=force))["unrest"] == {
        "force_rms": {"value": 0.02, "stderr": None, "unit": "N"},
        "memory": {"value": 8e-3, "stderr": 1e-3, "unit": "s"},
        "share": 0.012,
        "share_of": "the spring's force",
    }


def test_forecasts_of_held_back_records_are_stated(result):
    far = (Horizon(periods=1.0, seconds=0.2, nrmse={"impact_force": 0.1}), Horizon(periods=None, seconds=0.7, nrmse={"impact_force": 0.3}))
    held = dataclasses.replace(result.records[1], horizons=far)
    (found,) = fit_json(dataclasses.replace(result, held_back=(held,)))["held_back"]
    assert found["horizons"] == [
        {"periods": 1.0, "seconds": 0.2, "nrmse": {"impact_force": 0.1}},
        {"periods": None, "seconds": 0.7, "nrmse": {"impact_force": 0.3}},
    ]
    assert "horizons" not in fit_json(result)["records"][0]


def test_provenance_holds_versions_inputs_seed_and_time(result):
    provenance = fit_json(dataclasses.replace(result, seed=8))["provenance"]
    assert {"python", "jax", "diffrax", "numpy", "scipy", "vibrojax"} <= set(provenance["versions"])
    assert provenance["sha256"] == {"experiment.toml": "cd" * 32, "drop.csv": "ab" * 32, "cart1.csv": "ab" * 32}
    assert (provenance["seconds"], provenance["seed"]) == ({"fit": 1.5}, 8)


def test_a_parameter_that_is_not_determined_has_no_error_but_a_reason(result):
    zeta = fit_json(with_unknown(result, "zeta"))["parameters"]["zeta"]
    assert (zeta["status"], zeta["stderr"], zeta["ci95"]) == ("not identifiable from these records", None, None)
    assert zeta["reason"] == "nothing <moves> it"


def test_a_number_that_json_has_no_word_for_is_null(result, tmp_path):
    strange = dataclasses.replace(result, chi2_reduced=np.inf, discretisation=np.nan, correlation=np.full((5, 5), np.nan))
    write_json(fit_json(strange), tmp_path / "fit.json")

    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    document = json.loads((tmp_path / "fit.json").read_text(), parse_constant=refuse)
    assert (document["chi2_reduced"], document["discretisation"], document["correlation"]["matrix"][0][1]) == (None, None, None)


def test_every_digit_survives(result, tmp_path):
    write_json(fit_json(result), tmp_path / "fit.json")
    assert json.loads((tmp_path / "fit.json").read_text()) == fit_json(result)


def test_plain_knows_numpy():
    assert plain([np.float64(0.1), np.int32(2), np.bool_(True), None, "a", (np.inf,)]) == [0.1, 2, True, None, "a", [None]]
