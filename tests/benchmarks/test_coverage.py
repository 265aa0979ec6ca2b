import json
import sys

import numpy as np
import pytest

from benchmarks.coverage import __main__ as command
from benchmarks.coverage.summary import summary, table
from benchmarks.coverage.trial import RIGS, Experiment, trial


def row(name, z):
    return {"name": name, "truth": 1.0, "value": 1.0 + 0.1 * z, "stderr": 0.1, "z": z, "covered": abs(z) < 1.96}


def test_summary_counts_intervals_and_failures():
    trials = [
        {"key": "a", "rows": [row("n", -1.0)], "chi2_reduced": 1.0, "converged": True, "seconds": 1.0},
        {"key": "b", "rows": [row("n", 3.0)], "chi2_reduced": 1.2, "converged": False, "seconds": 3.0},
        {"key": "c", "failure": "ArithmeticError: no", "seconds": 2.0},
    ]
    result = summary(trials)
    assert (result["parameters"]["n"]["covered"], result["parameters"]["n"]["of"]) == (1, 2)
    assert result["parameters"]["n"]["z_mean"] == pytest.approx(1.0)
    assert result["parameters"]["k_i"]["of"] == 0
    assert result["chi2_reduced"] == {"least": 1.0, "largest": 1.2}
    assert (result["not_converged"], result["failures"]) == (["b"], {"c": "ArithmeticError: no"})
    assert table("quiet", result).row_count == 8


def test_the_interval_of_a_share_is_that_of_clopper_and_pearson():
    trials = [
        {"key": str(i), "rows": [row("n", z)], "chi2_reduced": 1.0, "converged": True, "seconds": 1.0} for i, z in enumerate([0.0] * 10)
    ]
    assert summary(trials)["parameters"]["n"]["ci95"] == pytest.approx([0.025**0.1, 1.0])


@pytest.mark.parametrize("rig", RIGS)
def test_one_small_trial(rig):
    found = trial(Experiment(rig=rig, seed=0, index=1, samples=(1201, 1201)))
    assert "failure" not in found, found["failure"]
    json.dumps(found)
    assert (found["unrest"] is not None, found["colour"] is not None) == ("force" in RIGS[rig], "colour" in RIGS[rig])
    assert {r["name"] for r in found["rows"]} >= {"k_i", "n", "lambda_i", "zeta", "f_n", "gap_error", "base_amplitude", "base_phase"}
    if rig == "quiet":
        assert found["chi2_reduced"] == pytest.approx(1.0, abs=0.1)
        assert all(abs(r["z"]) < 6.0 for r in found["rows"] if r["z"] is not None)


def test_the_same_experiments_on_every_kind_of_rig_and_others_with_another_seed(monkeypatch):
    def seen(folder, rig, plans, seed):
        return {"rows": [], "rig of the fit": rig, "gaps": [plan.true_gap for plan in plans], "shaken": any(p.random_force for p in plans)}

    monkeypatch.setattr("benchmarks.coverage.trial._fitted", seen)
    monkeypatch.setattr("benchmarks.coverage.trial.write_experiment", lambda *of, **options: None)
    quiet, shaken, other = (trial(Experiment(rig=rig, seed=seed, index=3)) for rig, seed in (("quiet", 5), ("force", 5), ("quiet", 6)))
    assert (quiet["rig of the fit"], quiet["gaps"]) == (shaken["rig of the fit"], shaken["gaps"])
    assert quiet["rig of the fit"] != other["rig of the fit"]
    assert shaken["shaken"] and not quiet["shaken"]


def test_the_command_counts_each_kind_of_rig_and_resumes(tmp_path, monkeypatch, capsys):
    def fake_run(what, trial, wanted, lines, *, workers):
        ran.append([one.key for one in wanted])
        with lines.open("a", encoding="utf-8") as file:
            for one in wanted:
                z = np.random.default_rng(one.index).normal()
                done = {"key": one.key, "rows": [row("zeta", z)], "chi2_reduced": 1.0, "converged": True, "seconds": 1.0}
                file.write(json.dumps(done if one.index else {"key": one.key, "failure": "Error: x", "seconds": 1.0}) + "\n")

    ran = []
    monkeypatch.setattr(command, "run_trials", fake_run)
    for arguments in (["--rigs", "quiet", "force", "--count", "2"], ["--rigs", "force", "--count", "3", "--resume"]):
        monkeypatch.setattr(sys, "argv", ["coverage", *arguments, "--seed", "7", "--workers", "2", "--json", str(tmp_path / "x.json")])
        command.main()
    assert ran == [["quiet-7-0000", "quiet-7-0001", "force-7-0000", "force-7-0001"], ["force-7-0000", "force-7-0002"]]
    result = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert (list(result["rigs"]), result["seed"]) == (["force"], 7)
    found = result["rigs"]["force"]
    assert (found["experiments"], found["parameters"]["zeta"]["of"], len(found["failures"])) == (3, 2, 1)
    assert "force rigs" in capsys.readouterr().out


def test_intervals_under_a_random_force_are_those_of_a_parabola():
    """The likelihood of a flight is one: where the profile is, too, the random force moves with the parameter."""
    found = trial(Experiment(rig="force", seed=2070, index=9, samples=(2001, 4001)))
    kinds = {row["name"]: row["interval"] for row in found["rows"] if "interval" in row}
    assert (kinds["f_n"], kinds["zeta"]) == ("normal", "normal")
