import json
import sys

import numpy as np
import pytest

from benchmarks.posterior import __main__ as command
from benchmarks.posterior.curved import NAME, write_curved
from benchmarks.posterior.trial import area_interval, in_standard_errors, profile_interval
from identification.experiment import load_experiment
from identification.result.result import LikelihoodProfile, ParameterEstimate
from vibrojax.contact.base import IMPACT_EXPONENT, IMPACT_STIFFNESS


def estimate(spec, value, stderr):
    return ParameterEstimate(spec=spec, value=value, stderr=stderr, ci95=None, interval="", initial=value, status="ok")


def test_distances_are_in_standard_errors_of_the_logarithm_or_of_the_exponent():
    stiffness, exponent = estimate(IMPACT_STIFFNESS, 1e6, 1e5), estimate(IMPACT_EXPONENT, 1.5, 0.1)
    np.testing.assert_allclose(in_standard_errors(stiffness, (1e6 * np.exp(-0.2), 1e6)), [-2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(in_standard_errors(exponent, (1.6, 1.75)), [1.0, 2.5], atol=1e-9)


@pytest.mark.parametrize(
    ("rise", "found"),
    [
        (lambda at: at**2, [-1.96, 1.96]),
        (lambda at: np.where(at < 0, (at / 1.2) ** 2, (at / 0.8) ** 2), [-1.2 * 1.96, 0.8 * 1.96]),
        (lambda at: np.where(at < 0, 0.4 * at**2, at**2), [None, 1.96]),
    ],
    ids=["parabola", "skewed", "open"],
)
def test_an_interval_ends_where_the_profile_has_risen(rise, found):
    at = np.linspace(-3.0, 3.0, 13)
    curve = LikelihoodProfile(name="n", values=tuple(1.5 + 0.1 * at), rise=tuple(rise(at)))
    for end, expected in zip(profile_interval(estimate(IMPACT_EXPONENT, 1.5, 0.1), curve), found, strict=True):
        assert end == (None if expected is None else pytest.approx(expected, abs=1e-6))


def test_the_area_of_a_likelihood_that_is_normal_in_the_value_is_that_of_its_logarithm():
    """A normal likelihood of k_i with a standard error of 20 %, prior flat in ln k_i: density N(k; 1, 0.2) / k."""
    at = np.linspace(-3.0, 3.0, 13)
    curve = LikelihoodProfile(name="k_i", values=tuple(1e6 * np.exp(0.2 * at)), rise=tuple((np.expm1(0.2 * at) / 0.2) ** 2))
    k = np.linspace(0.02, 3.0, 20001)
    share = np.cumsum(np.exp(-0.5 * ((k - 1.0) / 0.2) ** 2) / k)
    expected = np.log(np.interp([0.025, 0.975], share / share[-1], k)) / 0.2
    np.testing.assert_allclose(area_interval(estimate(IMPACT_STIFFNESS, 1e6, 2e5), curve), expected, atol=0.03)


def test_the_simulated_experiment_is_one_drop_test(tmp_path):
    write_curved(tmp_path)
    experiment = load_experiment(tmp_path)
    assert [record.kind for record in experiment.records] == ["drop-test"]
    assert set(experiment.sensors) == {"hammer_displacement", "cart_displacement"}


def test_the_command_shows_intervals_side_by_side_and_resumes(tmp_path, monkeypatch, capsys):
    def fake_run(what, trial, wanted, lines, *, workers):
        ran.append([one.name for one in wanted])
        with lines.open("a", encoding="utf-8") as file:
            for one in wanted:
                file.write(json.dumps({"name": one.name, "draws": one.draws} | (done if one.name == NAME else {"failure": "E: x"})) + "\n")

    ran = []
    known = {"value": 1.5, "stderr": 0.1, "draws": [-1.8, 2.1], "profile": [None, 2.0], "area": [-1.9, 2.05]}
    figures = {"effective": 912.0, "tail": 0.34, "minutes": 2.0, "processor_minutes": 1.9}
    done = {"parameters": {"n": known, "k_i": None}} | figures
    monkeypatch.setattr(command, "run_trials", fake_run)
    monkeypatch.setenv("COLUMNS", "140")
    for more in ([], ["--resume"]):
        monkeypatch.setattr(sys, "argv", ["posterior", str(tmp_path / "a/b"), *more, "--json", str(tmp_path / "x.json")])
        command.main()
    assert ran == [[NAME, "a/b"], ["a/b"]]
    shown = capsys.readouterr().out
    assert "-1.80 +2.10" in shown and "open +2.00" in shown and "912" in shown and "E: x" in shown
    assert [one["name"] for one in json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))["trials"]] == [NAME, "a/b"]
