"""Draws of a fit, and what they leave of a study."""

import json

import numpy as np
import pytest

from tests.batch.rigs import AMPLITUDE, GAP, model
from tests.studies.made_fit import written_fit
from vibrojax.batch import Span
from vibrojax.errors import InputError
from vibrojax.studies import basins, bifurcation, frequency_response, lyapunov, peterka, section
from vibrojax.studies.base import PERIODIC
from vibrojax.studies.draws import Draws, read_fit
from vibrojax.studies.job import Job
from vibrojax.studies.quantiles import LEVELS
from vibrojax.studies.run import make
from vibrojax.studies.write import write_study

SHORT = Span(transient=24, recorded=8)


def drawn() -> Draws:
    """Few draws that are far apart."""
    return Draws(names=("k_i", "zeta", "f_n"), values=np.array([[1e6, 0.02, 4.0], [2e6, 0.03, 4.1], [5e5, 0.05, 3.6]]), seed=3)


def job(study: str, axes: dict, **settings) -> Job:
    return Job(study=study, model=model(), axes=axes, settings={"base_amplitude": AMPLITUDE, "span": SHORT} | settings, draws=drawn())


def each():
    """The models of all draws."""
    return [model().replace({"k_i": k, "zeta": z, "f_n": f}) for k, z, f in drawn().values]


def test_draws_have_the_errors_and_correlations_of_the_fit(tmp_path):
    written_fit(tmp_path)
    fit = read_fit(tmp_path)
    draws = fit.draw(20000, seed=1)
    assert draws.names == ("k_i", "n", "zeta") and (draws.values > 0).all()
    logs = np.log(draws.values)
    np.testing.assert_allclose(logs.std(axis=0), [0.1, 0.01 / 1.5, 0.1], rtol=0.03)
    np.testing.assert_allclose(np.corrcoef(logs.T), [[1, 0.9, 0], [0.9, 1, 0], [0, 0, 1]], atol=0.03)
    np.testing.assert_allclose(np.median(draws.values, axis=0), [1e6, 1.5, 0.02], rtol=0.01)
    np.testing.assert_array_equal(fit.draw(5, seed=1).values, fit.draw(5, seed=1).values)
    assert (fit.draw(5, seed=1).values != fit.draw(5, seed=2).values).all()
    assert draws.model(model(), 7).values()["n"] == draws.values[7, 1]
    assert draws.model(model(), 7).values()["f_n"] == 4.0


def test_a_mass_that_was_estimated_is_drawn_too(tmp_path):
    written_fit(tmp_path, errors={"k_i": 1e5, "m": 0.01}, names=("k_i", "m"), m=0.5)
    draws = read_fit(tmp_path).draw(2000, seed=1)
    assert draws.names == ("k_i", "m")
    assert draws.values[:, 1].std() == pytest.approx(0.01, rel=0.1)
    assert float(draws.model(model(), 3).mass) == draws.values[3, 1]


def test_a_fit_that_cannot_be_drawn_from_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"model.json cannot be read"):
        read_fit(tmp_path)
    written_fit(tmp_path, errors={})
    with pytest.raises(InputError, match="gives no parameter a standard error"):
        read_fit(tmp_path)
    written_fit(tmp_path, k_i=2e6)
    with pytest.raises(
        InputError, match=r"fit.json has k_i = 2e\+06, model.json has 1000000.0: expected the fit.json and model.json that one"
    ):
        read_fit(tmp_path)
    (tmp_path / "fit.json").write_text('{"schema": 1}')
    with pytest.raises(InputError, match=r"fit.json is no fit.json \(KeyError"):
        read_fit(tmp_path)
    written_fit(tmp_path)
    with pytest.raises(InputError, match="0 draws: expected at least 1"):
        read_fit(tmp_path).draw(0, seed=0)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"names": ["k_i", "n", "zeta"]', '"names": 3'),
        ('"names": ["k_i", "n", "zeta"]', '"names": [["k_i"], {}, "zeta"]'),
        ('"names": ["k_i", "n", "zeta"]', '"names": ["k_i", "k_i", "zeta"]'),
        ('"names": ["k_i", "n", "zeta"]', '"names": ["k_i", "n"]'),
        ('"stderr": 100000.0', '"stderr": 1' + "0" * 400),
        ('"stderr": 100000.0', '"stderr": [1]'),
        ('"stderr": 100000.0', '"stderr": 1e999'),
        ('"matrix": [', '"matrix": [[], '),
        ('"matrix": [', '"matrix": ["x", '),
        ('"parameters": {', '"parameters": [], "more": {'),
        ('{"schema": 1', '[{"schema": 1'),
        ('{"schema": 1', '{"schema": 1, "schema": 1'),
    ],
)
def test_a_malformed_fit_is_one_line(old, new, tmp_path):
    written_fit(tmp_path)
    whole = (tmp_path / "fit.json").read_text()
    assert old in whole
    (tmp_path / "fit.json").write_text(whole.replace(old, new))
    with pytest.raises(InputError, match=r"fit.json (is no fit.json|is not valid JSON)"):
        read_fit(tmp_path)


@pytest.mark.parametrize(
    "wrong", [[[1, 0.9, 0], [0.2, 1, 0], [0, 0, 1]], [[1, 0.9, 0.9], [0.9, 1, -0.9], [0.9, -0.9, 1]], np.diag([1, 4, 1]).tolist()]
)
def test_a_matrix_that_no_parameters_can_have_is_refused(wrong, tmp_path):
    """Not symmetric; with a negative eigenvalue; not 1 on the diagonal."""
    written_fit(tmp_path)
    document = json.loads((tmp_path / "fit.json").read_text())
    document["correlation"]["matrix"] = wrong
    (tmp_path / "fit.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="a matrix of correlations that is none"):
        read_fit(tmp_path)


def test_values_beyond_all_numbers_are_drawn_again(tmp_path):
    """A stiffness whose logarithm has an error of 100 overflows now and then."""
    written_fit(tmp_path, errors={"k_i": 1e8}, names=("k_i",))
    assert np.isfinite(read_fit(tmp_path).draw(20, seed=1).values).all()


def test_a_map_over_draws_is_that_of_the_drawn_models(tmp_path):
    plane = {"clearance": np.array([0.2, 1.0]), "ratio": np.array([1.4, 1.9, 2.6, 3.2])}
    found = make(job("peterka", plane, lyapunov_cycles=0))
    maps = [peterka(one, **plane, base_amplitude=AMPLITUDE, span=SHORT, lyapunov_cycles=0) for one in each()]
    first = np.stack([(m["kind"] == PERIODIC) & (m["impacts"] == 1) & (m["period"] == 1) for m in maps])
    np.testing.assert_allclose(found["probability_1_1"], first.mean(axis=0))
    assert 0 < first.mean() < 1
    force = np.where(first, np.stack([m["impact_force"] for m in maps]), np.nan)
    for place in np.argwhere(first.any(axis=0)):
        values = force[:, place[0], place[1]]
        expected = np.quantile(values[np.isfinite(values)], LEVELS)
        np.testing.assert_allclose(found["impact_force"].isel(clearance=place[0], ratio=place[1]), expected, rtol=1e-5)
    assert np.isnan(found["impact_force"].values[:, ~first.any(axis=0)]).all()
    assert found["impact_force"].dims == ("quantile", "clearance", "ratio") and found["impact_force"].attrs["units"] == "N"
    np.testing.assert_array_equal(found["drawn"], drawn().values)
    stored = make(job("peterka", plane, lyapunov_cycles=0), store=tmp_path / "a.zarr")
    np.testing.assert_array_equal(stored["probability_1_1"], found["probability_1_1"])
    np.testing.assert_allclose(stored["impact_force"], found["impact_force"], rtol=1e-5)
    check_drawn("peterka", found, tmp_path)


def test_a_response_and_its_quantiles(tmp_path):
    line = {"gap": np.array([0.0, GAP]), "frequency_hz": np.array([5.0, 6.0, 7.0])}
    found = make(job("response", line))
    force = np.stack([frequency_response(one, **line, base_amplitude=AMPLITUDE, span=SHORT)["impact_force"] for one in each()])
    np.testing.assert_allclose(found["impact_force"], np.quantile(force, LEVELS, axis=0), rtol=1e-5)
    assert found["probability_impact"].max() == 1.0
    check_drawn("response", found, tmp_path)


def test_a_sweep_over_draws(tmp_path):
    gaps = np.linspace(2e-3, 8e-3, 5)
    settings = {"parameter": "gap", "frequency_hz": 7.0}
    found = make(job("bifurcation", {"values": gaps}, **settings))
    alone = [bifurcation(one, values=gaps, base_amplitude=AMPLITUDE, span=SHORT, **settings) for one in each()]
    np.testing.assert_allclose(found["probability_jump"], np.mean([one["jump"] for one in alone], axis=0))
    highest = np.stack([one["displacement"].max("cycle") for one in alone])
    np.testing.assert_allclose(found["displacement_highest"], np.quantile(highest, LEVELS, axis=0), rtol=1e-5, atol=1e-8)
    stored = make(job("bifurcation", {"values": gaps}, **settings), store=tmp_path / "a.zarr")
    np.testing.assert_allclose(stored["impact_force"], found["impact_force"], rtol=1e-4, atol=1e-6)
    check_drawn("bifurcation", found, tmp_path)


def test_basins_and_exponents_over_draws(tmp_path):
    plane = {"v0": np.array([-0.1, 0.0, 0.3]), "u0": np.array([-2e-3, 2e-3])}
    point = {"frequency_hz": 7.0, "gap": 4e-3}
    found = make(job("basins", plane, **point))
    alone = [basins(one, **plane, **point, base_amplitude=AMPLITUDE, span=SHORT) for one in each()]
    np.testing.assert_allclose(found["probability_impacting"], np.mean([one["impacting"] == 1 for one in alone], axis=0))
    np.testing.assert_allclose(found["basin_measure"], np.quantile([one.attrs["basin_measure"] for one in alone], LEVELS))
    check_drawn("basins", found, tmp_path)
    line = {"parameter": "frequency_hz", "gap": 1.0, "cycles": 20}
    found = make(job("lyapunov", {"values": np.array([5.0, 8.0])}, **line))
    exponents = [lyapunov(one, values=np.array([5.0, 8.0]), base_amplitude=AMPLITUDE, span=SHORT, **line)["exponent"] for one in each()]
    np.testing.assert_allclose(found["exponent"], np.quantile(exponents, LEVELS, axis=0), rtol=1e-4)
    assert (found["probability_chaos"] == 0).all()
    check_drawn("lyapunov", found, tmp_path)


def test_histories_over_draws(tmp_path):
    point = dict(frequency_hz=5.2, gap=GAP, base_amplitude=AMPLITUDE, strobes=4, transient=8, cycles=1, samples=40)
    one = Job(study="section", model=model(), axes={}, settings=point, draws=drawn())
    found = make(one, store=tmp_path / "a.zarr")
    alone = np.stack([section(rig, even=True, **point)["u"] for rig in each()])
    np.testing.assert_allclose(found["u"], np.quantile(alone, LEVELS, axis=0), rtol=1e-6, atol=1e-12)
    assert found["u"].dims == ("quantile", "time") and found["time"].attrs["units"] == "s"
    check_drawn("section", found, tmp_path)


def check_drawn(name: str, data, folder) -> None:
    files = write_study(name, data, folder)
    assert all(file.stat().st_size > (200 if file.suffix == ".md" else 1000) for file in files)
