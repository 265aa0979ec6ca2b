"""Basins beside SciPy, few initial states."""

from benchmarks.basins import CASES, WORST, compared


def test_shares_and_single_initial_states_agree_with_scipy():
    found = compared(CASES["duffing"], 6, 60, 0)
    assert {row["attractor"] for row in found["attractors"]} == {"no impact a", "no impact b"}
    assert found["same_attractor"] == found["scipy_states"] == 6
    assert all(row["standard_errors"] < WORST for row in found["attractors"])


def test_an_impact_oscillator_strikes_and_stays_off_as_with_scipy():
    found = compared(CASES["impact_8"], 4, 40, 3)
    assert {row["attractor"] for row in found["attractors"]} == {"no impact", "z = 1/1"}
    assert found["same_attractor"] == 4
