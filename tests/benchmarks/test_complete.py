import json
import sys

import pytest

from benchmarks.complete import __main__ as command
from benchmarks.complete.rigs import Job
from benchmarks.complete.trial import is_right, trial


def row(name, z, **more):
    return {"name": name, "z": z, **more}


@pytest.mark.parametrize(
    ("change", "right"),
    [
        ({}, True),
        ({"converged": False}, False),
        ({"chi2_reduced": 1.06}, False),
        ({"rows": [row("n", -3.1)]}, False),
        ({"rows": [row("n", None)]}, False),
        ({"failure": "Error: x"}, False),
    ],
)
def test_a_fit_is_right_where_it_converged_to_the_noise_and_to_the_truth(change, right):
    found = {"converged": True, "chi2_reduced": 0.96, "rows": [row("n", 2.9), row("gap_error", 9.0, record="a.csv")]}
    assert is_right(found | change) is right


def test_a_complete_model_is_found_complete_on_awkward_records():
    """The cart of one record was not recorded, the drop test hardly strikes, rates differ, and there is no load cell."""
    found = trial(Job(seed=1, index=0, samples=(2001, 4001)))
    json.dumps(found)
    assert "failure" not in found, found["failure"]
    assert found["unseen"] == ["cart2.csv"] and len(set(found["every"])) > 1
    assert found["converged"] and found["chi2_reduced"] == pytest.approx(1.0, abs=0.07)
    shared = [one for one in found["rows"] if "record" not in one]
    assert {one["name"] for one in shared} == {"k_i", "n", "lambda_i", "zeta", "f_n"}
    assert all(abs(one["z"]) < 4.0 for one in shared)


def test_the_command_counts_what_is_right_and_resumes(tmp_path, monkeypatch, capsys):
    def fake_run(what, trial, wanted, lines, *, workers):
        ran.append([one.key for one in wanted])
        with lines.open("a", encoding="utf-8") as file:
            for one in wanted:
                done = {"key": one.key, "unseen": [], "accelerometer": False, "seconds": 1.0, "right": one.index != 1}
                more = (
                    {"rows": [row("zeta", 1.5), row("n", -0.5)], "chi2_reduced": 1.0}
                    if one.index
                    else {"failure": "Error: x", "right": False}
                )
                file.write(json.dumps(done | more) + "\n")

    ran = []
    monkeypatch.setattr(command, "run_trials", fake_run)
    for arguments in (["--count", "2"], ["--count", "3", "--resume"]):
        monkeypatch.setattr(sys, "argv", ["complete", *arguments, "--seed", "7", "--json", str(tmp_path / "x.json")])
        command.main()
    assert ran == [["7-000", "7-001"], ["7-000", "7-002"]]
    result = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert (result["right"], result["of"], result["seed"]) == (1, 3, 7)
    shown = capsys.readouterr().out
    assert "right: 1 of 3" in shown and "zeta +1.5" in shown
