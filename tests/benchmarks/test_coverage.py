import pytest

from benchmarks.coverage.summary import summary, table
from benchmarks.coverage.trial import trial


def row(name, z):
    return {"name": name, "truth": 1.0, "value": 1.0 + 0.1 * z, "stderr": 0.1, "z": z, "covered": abs(z) < 1.96}


def test_summary_counts_intervals_and_failures():
    trials = [
        {"index": 0, "rows": [row("n", -1.0)], "chi2_reduced": 1.0, "converged": True, "seconds": 1.0},
        {"index": 1, "rows": [row("n", 3.0)], "chi2_reduced": 1.2, "converged": False, "seconds": 3.0},
        {"index": 2, "failure": "ArithmeticError: no", "seconds": 2.0},
    ]
    result = summary(trials)
    assert (result["parameters"]["n"]["covered"], result["parameters"]["n"]["of"]) == (1, 2)
    assert result["parameters"]["n"]["z_mean"] == pytest.approx(1.0)
    assert result["parameters"]["k_i"]["of"] == 0
    assert result["chi2_reduced"] == {"least": 1.0, "largest": 1.2}
    assert (result["not_converged"], result["failures"]) == ([1], {2: "ArithmeticError: no"})
    assert table(result).row_count == 8


def test_one_small_trial():
    found = trial(1, samples=(1201, 1201))
    assert "failure" not in found
    assert {r["name"] for r in found["rows"]} >= {"k_i", "n", "lambda_i", "zeta", "f_n", "gap_error", "base_amplitude", "base_phase"}
    assert found["chi2_reduced"] == pytest.approx(1.0, abs=0.1)
    assert all(abs(r["z"]) < 6.0 for r in found["rows"] if r["z"] is not None)
